// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "daemon/facades/usb_camera/uvc_descriptors.h"

namespace toftwin::daemon::usb_camera {

/// One image on its way to the host.
struct Picture {
  Bytes pixels;
  std::uint32_t stamp = 0;  ///< when it was taken, on the camera's clock of kClockHz
  bool is_damaged = false;  ///< which the payloads' headers tell
};

/// A UVC camera: answers requests, cuts pictures into payloads. Where these come from says who derives from
/// it.
class UvcDevice : public UsbDevice {
 public:
  explicit UvcDevice(UvcLayout layout);
  [[nodiscard]] const UvcLayout& layout() const { return layout_; }

  [[nodiscard]] UsbSpeed speed() const final { return layout_.speed; }
  [[nodiscard]] Bytes deviceDescriptor() const final { return deviceDescriptorOf(layout_); }
  [[nodiscard]] Bytes configurationDescriptor() const final { return configurationDescriptorOf(layout_); }
  [[nodiscard]] std::string text(int index) const final;
  Answer control(const Setup& setup, std::span<const std::byte> out) final;
  void onAttach() final;
  void onInterface(int number, int alternate) final;
  void onClearHalt(std::uint8_t endpoint) final;
  bool serve(Transfer& transfer, SteadyTime now) final;
  [[nodiscard]] SteadyTime due(std::uint8_t endpoint) const final;

 protected:
  enum class Number { Exposure_100us, Gain };
  [[nodiscard]] virtual std::uint32_t number(Number which) const = 0;
  virtual Answer setNumber(Number which, std::uint32_t value) = 0;
  /// The host has chosen it, and is about to stream.
  virtual Answer setInterval(std::uint32_t /*interval_100ns*/) { return {}; }
  /// The stream's next picture, if it is time for it; asked while the host waits for one.
  virtual std::optional<Picture> nextPicture(std::size_t stream, SteadyTime now) = 0;
  /// When to ask for it again.
  [[nodiscard]] virtual SteadyTime nextPictureDue(std::size_t stream) const = 0;
  /// The host has ended the stream, or is about to begin it.
  virtual void onReset(std::size_t /*stream*/) {}
  /// The camera's clock, of kClockHz.
  [[nodiscard]] virtual std::uint32_t clockNow(SteadyTime now) const = 0;

  /// Why a request was refused, which hosts ask for. [USB Video Class 1.1, table 4-7]
  enum class Refusal : std::uint8_t { None = 0, NotReady = 1, OutOfRange = 4, NoSuchControl = 6 };
  Answer refuse(Refusal why);

  /// Whether a picture is under way.
  [[nodiscard]] bool isSending(std::size_t stream) const { return streams_[stream].picture.has_value(); }

 private:
  struct Stream {
    std::uint32_t interval_100ns = 0;  ///< that the host has chosen
    std::optional<Picture> picture;    ///< being sent
    std::size_t sent = 0;
    bool is_toggled = false;
    Bytes payload;  ///< bulk: being sent, in as many transfers as it takes
    std::size_t payload_sent = 0;
    bool must_end_short = false;  ///< a transfer without bytes is to say that the payload has ended
    std::optional<SteadyTime> next_transfer;  ///< isochronous; none: not streaming
  };
  [[nodiscard]] Answer probe(Stream& stream, std::uint32_t picture_bytes, const Setup& setup,
                             std::span<const std::byte> out);
  [[nodiscard]] Answer numberControl(const Setup& setup, std::span<const std::byte> out, Number which,
                                     std::size_t size, const std::optional<ControlRange>& range);
  void reset(std::size_t number);
  bool begin(std::size_t number, SteadyTime now);
  std::uint32_t putPayload(Stream& stream, Bytes& out, std::size_t most, SteadyTime now);
  bool serveBulk(std::size_t number, Transfer& transfer, SteadyTime now);
  bool serveIsochronous(std::size_t number, Transfer& transfer, SteadyTime now);

  const UvcLayout layout_;
  std::vector<Stream> streams_;
  Refusal refusal_ = Refusal::None;
};

}  // namespace toftwin::daemon::usb_camera
