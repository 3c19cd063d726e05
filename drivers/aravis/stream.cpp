// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/stream.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "drivers/aravis/packet_filter.h"

namespace toftwin::drivers::aravis {
namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 30;
constexpr std::size_t kLeastSocketBuffer = std::size_t{1} << 20;
constexpr std::chrono::seconds kOldestArrival{10};

std::string_view textOf(ArvBufferStatus status) {
  switch (status) {
    case ARV_BUFFER_STATUS_TIMEOUT:
    case ARV_BUFFER_STATUS_MISSING_PACKETS:
      return "packets of it did not come";
    case ARV_BUFFER_STATUS_SIZE_MISMATCH:
      return "it was larger or smaller than the camera had said";
    case ARV_BUFFER_STATUS_WRONG_PACKET_ID:
      return "its packets were numbered wrongly";
    case ARV_BUFFER_STATUS_ABORTED:
      return "it was cut off";
    default:
      return "the library could not read it";
  }
}

/// When a buffer's first packet came: the library knows by the wall clock, which may be set, but
/// hardly so between two lines.
SteadyTime arrivalOf(ArvBuffer* buffer) {
  const auto now = std::chrono::steady_clock::now();
  const std::chrono::nanoseconds wall_now = std::chrono::system_clock::now().time_since_epoch();
  const auto came = std::chrono::nanoseconds{arv_buffer_get_system_timestamp(buffer)};
  const auto ago = wall_now - came;
  if (ago < std::chrono::nanoseconds{0} || ago > kOldestArrival) return now;
  return now - ago;
}

}  // namespace

std::vector<Part> partsOf(ArvBuffer* buffer, std::size_t allocated) {
  std::vector<Part> parts;
  std::size_t size = 0;
  const void* data = arv_buffer_get_data(buffer, &size);
  const ArvBufferPayloadType payload = arv_buffer_get_payload_type(buffer);
  const bool may_have_images = payload == ARV_BUFFER_PAYLOAD_TYPE_IMAGE ||
                               payload == ARV_BUFFER_PAYLOAD_TYPE_EXTENDED_CHUNK_DATA ||
                               payload == ARV_BUFFER_PAYLOAD_TYPE_MULTIPART;
  // Of others the library, asked for an image's size, complains on stderr.
  if (data == nullptr || !may_have_images) return parts;
  const auto begin = reinterpret_cast<std::uintptr_t>(data);
  const std::uint64_t received = std::min(size, allocated);
  for (guint i = 0; i < arv_buffer_get_n_parts(buffer); ++i) {
    const void* at = arv_buffer_get_part_data(buffer, i, &size);
    // The library takes a part's place and size from the camera without a look at the buffer's.
    const std::uint64_t offset = reinterpret_cast<std::uintptr_t>(at) - begin;
    const ArvBufferPartDataType type = arv_buffer_get_part_data_type(buffer, i);
    const bool is_image = type == ARV_BUFFER_PART_DATA_TYPE_2D_IMAGE ||
                          type == ARV_BUFFER_PART_DATA_TYPE_3D_IMAGE ||
                          type == ARV_BUFFER_PART_DATA_TYPE_CONFIDENCE_MAP;
    if (at == nullptr || offset > received || !is_image) continue;
    gint x = 0, y = 0, width = 0, height = 0, x_padding = 0, y_padding = 0;
    arv_buffer_get_part_region(buffer, i, &x, &y, &width, &height);
    arv_buffer_get_part_padding(buffer, i, &x_padding, &y_padding);
    const auto bytes = static_cast<std::size_t>(std::min<std::uint64_t>(size, received - offset));
    parts.push_back({.bytes = {static_cast<const std::byte*>(data) + offset, bytes},
                     .width = width,
                     .height = height,
                     .row_padding = x_padding,
                     .format = arv_buffer_get_part_pixel_format(buffer, i),
                     .component = arv_buffer_get_part_component_id(buffer, i),
                     .is_range = type == ARV_BUFFER_PART_DATA_TYPE_3D_IMAGE});
  }
  return parts;
}

void Stream::configure(std::size_t frame_bytes) {
  if (ARV_IS_GV_STREAM(stream_.get()) == FALSE) return;
  const std::size_t socket_bytes = keys_.socket_buffer_kb > 0
                                       ? static_cast<std::size_t>(keys_.socket_buffer_kb) * 1024
                                       : std::max(kLeastSocketBuffer, 2 * frame_bytes);
  // "Auto" would make the buffer as small as a small frame, and lose its packets.
  g_object_set(stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED,
               "socket-buffer-size", static_cast<gint>(std::min(socket_bytes, kMostBytes)),
               "packet-timeout", static_cast<guint>(keys_.packet_timeout.in(microsecond)),
               "frame-retention", static_cast<guint>(keys_.frame_retention.in(microsecond)),
               nullptr);
  // A small frame has few packets, a quarter of which may be none: the library would ask for none.
  g_object_set(stream_.get(), "packet-request-ratio", 1.0, nullptr);
  if (!keys_.resend)
    g_object_set(stream_.get(), "packet-resend", ARV_GV_STREAM_PACKET_RESEND_NEVER, nullptr);
}

Result<> Stream::filter(const Connection& connection, std::uint32_t frame_bytes) const {
  if (ARV_IS_GV_STREAM(stream_.get()) == FALSE) return {};
  Failure failure;
  ArvCamera* camera = connection.camera();
  const StreamShape shape{
      .is_multipart = arv_camera_gv_get_multipart(camera, failure.slot()) != FALSE,
      .frame_bytes = frame_bytes,
      .packet_bytes = arv_camera_gv_get_packet_size(camera, failure.slot())};
  if (failure) return failure.toError("the packet size cannot be read");
  const int socket = connection.socketOfPort(arv_gv_stream_get_port(ARV_GV_STREAM(stream_.get())));
  return filterPackets(socket, shape);
}

Result<> Stream::start(Connection& connection) {
  ArvCamera* camera = connection.camera();
  Failure failure;
  const guint payload = arv_camera_get_payload(camera, failure.slot());
  if (failure) return failure.toError("the size of a frame cannot be read");
  if (payload == 0 || payload > kMostBytes) {
    return Error{Error::Code::Incompatible,
                 fmt::format("aravis: the camera says that a frame has {} bytes", payload)};
  }
  {
    const auto lock = lockLibrary();
    stream_.reset(arv_camera_create_stream(camera, nullptr, nullptr, failure.slot()));
  }
  if (failure || stream_ == nullptr) return failure.toError("the camera gives no stream");
  buffer_bytes_ = payload;
  configure(payload);
  if (auto filtered = filter(connection, payload); !filtered) {
    abandon();
    return filtered;
  }
  for (int i = 0; i < keys_.buffers; ++i)
    arv_stream_push_buffer(stream_.get(), arv_buffer_new_allocate(payload));
  arv_camera_start_acquisition(camera, failure.slot());
  if (!failure) return {};
  stop(connection);
  return failure.toError("the camera does not start to send");
}

void Stream::stop(Connection& connection) {
  if (stream_ == nullptr) return;
  Failure ignored;
  arv_camera_stop_acquisition(connection.camera(), ignored.slot());
  abandon();
}

std::optional<Stream::Filled> Stream::take(std::chrono::microseconds wait) {
  if (stream_ == nullptr) return std::nullopt;
  Object<ArvBuffer> buffer{arv_stream_timeout_pop_buffer(
      stream_.get(), static_cast<guint64>(std::max<std::int64_t>(0, wait.count())))};
  if (buffer == nullptr) return std::nullopt;
  Filled filled;
  const ArvBufferStatus status = arv_buffer_get_status(buffer.get());
  filled.arrived = arrivalOf(buffer.get());
  filled.frame_id = arv_buffer_get_frame_id(buffer.get());
  filled.stamp_ns = static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer.get()) &
                                              std::uint64_t{0x7FFFFFFFFFFFFFFF});
  if (status == ARV_BUFFER_STATUS_SUCCESS) {
    filled.parts = partsOf(buffer.get(), buffer_bytes_);
    if (filled.parts.empty()) filled.why_not_whole = "it has no image";
  } else {
    filled.why_not_whole = textOf(status);
  }
  filled.buffer = std::move(buffer);
  return filled;
}

void Stream::giveBack(Filled filled) {
  if (stream_ != nullptr) arv_stream_push_buffer(stream_.get(), filled.buffer.release());
}

bool Stream::hasWaiting() const {
  gint empty = 0, filled = 0;
  if (stream_ != nullptr) arv_stream_get_n_buffers(stream_.get(), &empty, &filled);
  return filled > 0;
}

PacketCounts Stream::counts() const {
  PacketCounts counts;
  if (stream_ == nullptr) return counts;
  guint64 completed = 0, failures = 0, underruns = 0;
  arv_stream_get_statistics(stream_.get(), &completed, &failures, &underruns);
  counts.underruns = underruns;
  if (ARV_IS_GV_STREAM(stream_.get()) != FALSE) {
    counts.asked_again = arv_stream_get_info_uint64_by_name(stream_.get(), "n_resend_requests");
    arv_gv_stream_get_statistics(ARV_GV_STREAM(stream_.get()), nullptr, &counts.missing);
  }
  return counts;
}

}  // namespace toftwin::drivers::aravis
