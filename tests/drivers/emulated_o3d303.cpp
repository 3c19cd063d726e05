// SPDX-License-Identifier: Apache-2.0
#include "emulated_o3d303.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <cmath>
#include <deque>
#include <future>
#include <list>
#include <memory>
#include <optional>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include "drivers/o3d303/wire/confidence.h"
#include "drivers/o3d303/wire/frame_writer.h"
#include "drivers/o3d303/wire/pcic.h"

namespace toftwin::test {
namespace {

namespace http = boost::beast::http;
using boost::asio::ip::tcp;
using boost::system::error_code;
using Clock = std::chrono::steady_clock;
using o3d303::Bytes;

constexpr std::uint64_t kSeed = 20'265;
constexpr std::size_t kPixels = std::size_t{EmulatedO3d303::kWidth} * EmulatedO3d303::kHeight;

/// The images of a frame with what they are views of.
struct Images {
  std::vector<std::uint16_t> distance_mm = std::vector<std::uint16_t>(kPixels);
  std::vector<std::uint16_t> amplitude = std::vector<std::uint16_t>(kPixels);
  std::vector<std::uint8_t> confidence = std::vector<std::uint8_t>(kPixels);

  void draw(std::uint32_t count) {
    std::size_t i = 0;
    for (std::uint32_t y = 0; y < EmulatedO3d303::kHeight; ++y) {
      for (std::uint32_t x = 0; x < EmulatedO3d303::kWidth; ++x, ++i) {
        const auto pixel = EmulatedO3d303::pixelAt(count, x, y);
        distance_mm[i] = pixel.distance_mm;
        amplitude[i] = pixel.amplitude;
        confidence[i] = pixel.confidence;
      }
    }
  }
};

std::vector<float> rays() {
  std::vector<float> all;
  for (std::uint32_t v = 0; v < EmulatedO3d303::kHeight; ++v) {
    for (std::uint32_t u = 0; u < EmulatedO3d303::kWidth; ++u) {
      const double x = (u - (EmulatedO3d303::kWidth - 1) / 2.0) / EmulatedO3d303::kFocalLength_px;
      const double y = (v - (EmulatedO3d303::kHeight - 1) / 2.0) / EmulatedO3d303::kFocalLength_px;
      const double norm = std::sqrt(x * x + y * y + 1.0);
      for (const double e : {x, y, 1.0}) all.push_back(static_cast<float>(e / norm));
    }
  }
  return all;
}

}  // namespace

class EmulatedO3d303::Impl {
 public:
  explicit Impl(Options options) : options_(std::move(options)) {
    listen();
    thread_ = std::thread{[this] { io_.run(); }};
    run([this] { beginStream(); });
  }
  ~Impl() {
    run([this] {
      closeAll();
      io_.stop();  // whatever is under way: a timer whose handler is due cannot be cancelled
    });
    thread_.join();
  }

  /// Does it on the emulator's thread and waits for that.
  template <class Action>
  auto run(Action action) -> decltype(action()) {
    std::packaged_task<decltype(action())()> task{std::move(action)};
    auto done = task.get_future();
    boost::asio::post(io_, [&task] { task(); });
    return done.get();
  }

  void listen() {
    for (auto* acceptor : {&xmlrpc_, &pcic_}) {
      const bool is_pcic = acceptor == &pcic_;
      std::uint16_t& port = is_pcic ? pcic_port_ : xmlrpc_port_;
      acceptor->open(tcp::v4());
      acceptor->set_option(tcp::acceptor::reuse_address{true});
      acceptor->bind({boost::asio::ip::address_v4::loopback(), port});
      acceptor->listen();
      port = acceptor->local_endpoint().port();
      is_pcic ? acceptPcic() : acceptXmlRpc();
    }
    device_.device["PcicTcpPort"] = std::to_string(pcic_port_);
  }

  void closeAll() {
    error_code ignored;
    xmlrpc_.close(ignored);
    pcic_.close(ignored);
    reset();
  }
  /// Resets all connections: with "linger 0" the other side sees an error, not an end.
  void reset() {
    for (const auto& one : connections_) closeHard(one->socket);
    for (const auto& one : calls_) closeHard(*one);
    connections_.clear();
    calls_.clear();
  }
  static void closeHard(tcp::socket& socket) {
    error_code ignored;
    socket.set_option(boost::asio::socket_base::linger{true, 0}, ignored);
    socket.close(ignored);
  }

  // ---- XML-RPC ---------------------------------------------------------------------------------

  struct Call {
    std::shared_ptr<tcp::socket> socket;
    boost::beast::flat_buffer buffer;
    http::request<http::string_body> request;
    http::response<http::string_body> response;
  };

  void acceptXmlRpc() {
    xmlrpc_.async_accept([this](error_code error, tcp::socket socket) {
      if (error) return;
      auto call = std::make_shared<Call>();
      call->socket = std::make_shared<tcp::socket>(std::move(socket));
      calls_.push_back(call->socket);
      http::async_read(*call->socket, call->buffer, call->request,
                       [this, call](error_code e, std::size_t) {
                         if (!e && !is_hanging) return answer(call);
                         if (e) calls_.remove(call->socket);
                       });
      acceptXmlRpc();
    });
  }
  void answer(const std::shared_ptr<Call>& call) {
    const auto read = o3d303::readXmlRpcCall(call->request.body());
    const auto answer =
        read ? device_.answer({call->request.target().data(), call->request.target().size()}, *read)
             : o3d303::XmlRpcAnswer{o3d303::XmlRpcFault{1, read.error().message}};
    call->response.result(http::status::ok);
    call->response.body() = encodeXmlRpc(answer);
    maybeGarble(call->response.body(), 20);
    call->response.prepare_payload();
    http::async_write(*call->socket, call->response, [this, call](error_code, std::size_t) {
      error_code ignored;
      call->socket->shutdown(tcp::socket::shutdown_both, ignored);
      calls_.remove(call->socket);
    });
  }

  // ---- PCIC ------------------------------------------------------------------------------------

  struct Connection {
    explicit Connection(tcp::socket taken) : socket(std::move(taken)) {}
    tcp::socket socket;
    o3d303::PcicReader reader{1 << 20};
    std::array<std::byte, 4096> piece;
    std::optional<o3d303::Schema> schema;
    std::deque<Bytes> queue;
  };
  using ConnectionPtr = std::shared_ptr<Connection>;

  void acceptPcic() {
    pcic_.async_accept([this](error_code error, tcp::socket socket) {
      if (error) return;
      auto connection = std::make_shared<Connection>(std::move(socket));
      connections_.push_back(connection);
      read(connection);
      acceptPcic();
    });
  }
  void read(const ConnectionPtr& c) {
    c->socket.async_read_some(boost::asio::buffer(c->piece), [this, c](error_code error, std::size_t size) {
      if (error) return drop(c);
      c->reader.feed(std::span{c->piece}.first(size));
      while (true) {
        auto message = c->reader.next();
        if (!message) return drop(c);
        if (!*message) break;
        if (!is_hanging) obey(c, **message);
      }
      read(c);
    });
  }
  /// Also while it is being written to, which would keep its socket open after it is none of the connections.
  void drop(const ConnectionPtr& c) {
    closeHard(c->socket);
    connections_.remove(c);
  }
  void obey(const ConnectionPtr& c, const o3d303::PcicMessage& message) {
    const std::string_view command = o3d303::textOf(message.content);
    char answer = o3d303::kUnknown;
    bool is_trigger = false;
    if (const auto json = o3d303::schemaInCommand(command)) {
      auto schema = o3d303::readSchema(*json);
      answer = schema ? o3d303::kDone : o3d303::kRefused;
      if (schema) c->schema = *std::move(schema);
    } else if (command == "t") {
      is_trigger = !device_.isFreeRunning() && !device_.isEditing();
      answer = is_trigger ? o3d303::kDone : o3d303::kRefused;
    } else if (command.starts_with("p") && command.size() == 2) {
      answer = o3d303::kDone;
    }
    send(c, o3d303::encodePcic(message.ticket, std::string_view{&answer, 1}));
    if (is_trigger) makeFrame(Clock::now() - since_);
  }
  void send(const ConnectionPtr& c, Bytes bytes) {
    constexpr std::size_t kMostWaiting = 8;  // then frames are lost, as they are by the camera
    if (c->queue.size() >= kMostWaiting) return;
    c->queue.push_back(std::move(bytes));
    if (c->queue.size() == 1) write(c);
  }
  void write(const ConnectionPtr& c) {
    boost::asio::async_write(c->socket, boost::asio::buffer(c->queue.front()),
                             [this, c](error_code error, std::size_t) {
                               if (error) return;
                               c->queue.pop_front();
                               if (!c->queue.empty()) write(c);
                             });
  }

  // ---- frames ----------------------------------------------------------------------------------

  void beginStream() {
    since_ = Clock::now();
    index_ = 0;
    waitForNext();
  }
  void waitForNext() {
    timer_.expires_at(since_ + options_.schedule.leaves(index_));
    timer_.async_wait([this](error_code error) {
      if (error) return;
      if (device_.isFreeRunning() && !device_.isEditing() && pcic_.is_open()) {
        makeFrame(options_.schedule.stamped(index_));
      }
      ++index_;
      waitForNext();
    });
  }
  void makeFrame(std::chrono::nanoseconds taken) {
    ++count_;
    ++frames_made;
    if (is_hanging || (lose > 0 && lose-- > 0)) return;
    images_.draw(count_);
    const auto stamp =
        clock_begin + std::chrono::nanoseconds{static_cast<std::int64_t>(
                          static_cast<double>(taken.count()) * (1.0 + options_.clock_skew))};
    o3d303::CameraFrame frame;
    frame.frame_count = count_;
    frame.time = {static_cast<std::uint32_t>(stamp.count() / 1'000'000'000),
                  static_cast<std::uint32_t>(stamp.count() % 1'000'000'000)};
    frame.distance_mm = images_.distance_mm;
    frame.amplitude = frame.raw_amplitude = images_.amplitude;
    frame.confidence = images_.confidence;
    frame.unit_vectors = unit_vectors_;
    frame.extrinsics = options_.extrinsics;
    frame.exposures_us = {static_cast<std::uint32_t>(device_.imager("ExposureTime")), 0, 0};
    frame.illumination_c = kIllumination_c;
    const bool is_bad = corrupt > 0 && corrupt-- > 0;
    for (const ConnectionPtr& c : connections_) {
      if (!c->schema) continue;
      auto content = writeFrameContent(*c->schema, frame);
      if (content) send(c, messageOf(*std::move(content), is_bad));
    }
  }
  Bytes messageOf(Bytes content, bool is_bad) {
    // Behind "star" there is the first chunk's header.
    if (is_bad && !corrupt_framing) {
      for (std::size_t i = 8; i < 24; ++i) content[i] = static_cast<std::byte>(random_());
    }
    Bytes message = o3d303::encodePcic(o3d303::kFrameTicket, content);
    if (is_bad && corrupt_framing) message[4] = std::byte{'?'};
    maybeGarble(message, 2);
    return message;
  }
  /// One in so many.
  template <class Message>
  void maybeGarble(Message& message, std::uint64_t one_in) {
    if (garble == 0 || random_() % one_in != 0) return;
    --garble;
    damage(message);
  }
  /// The first bytes, which say what the others are, are hit as often as all others together.
  template <class Message>
  void damage(Message& message) {
    const auto below = [&](std::size_t limit) {
      return std::uniform_int_distribution<std::size_t>{0, limit - 1}(random_);
    };
    for (std::size_t left = 1 + below(4); left > 0 && !message.empty(); --left) {
      const std::size_t size = message.size();
      const std::size_t at = below(below(2) == 0 ? std::min<std::size_t>(size, 64) : size);
      const std::size_t length = std::min(size - at, 1 + below(32));
      const auto begin = message.begin() + static_cast<std::ptrdiff_t>(at);
      const auto end = begin + static_cast<std::ptrdiff_t>(length);
      const Message piece{begin, end};
      switch (below(3)) {
        case 0:
          for (auto byte = begin; byte != end; ++byte) {
            *byte = static_cast<typename Message::value_type>(random_());
          }
          break;
        case 1:
          message.erase(begin, end);
          break;
        default:
          message.insert(end, piece.begin(), piece.end());
      }
    }
  }

  Options options_;
  boost::asio::io_context io_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> stay_{
      io_.get_executor()};
  tcp::acceptor xmlrpc_{io_}, pcic_{io_};
  std::uint16_t xmlrpc_port_ = 0, pcic_port_ = 0;
  boost::asio::steady_timer timer_{io_};
  O3d303Device device_;
  std::list<ConnectionPtr> connections_;
  std::list<std::shared_ptr<tcp::socket>> calls_;
  Images images_;
  std::vector<float> unit_vectors_ = o3d303::unitVectorsFrom(rays(), options_.extrinsics);
  std::mt19937_64 random_{kSeed};
  Clock::time_point since_;
  std::uint64_t index_ = 0;
  std::uint32_t count_ = 0;

  bool is_hanging = false, corrupt_framing = false;
  int corrupt = 0, garble = 0, lose = 0, frames_made = 0;
  std::chrono::nanoseconds clock_begin = std::chrono::seconds{1'524'235'000};
  std::thread thread_;
};

EmulatedO3d303::EmulatedO3d303(Options options)
    : impl_(std::make_unique<Impl>(std::move(options))) {}
EmulatedO3d303::~EmulatedO3d303() = default;

std::string EmulatedO3d303::uri() const {
  return fmt::format("o3d303:127.0.0.1:{}", impl_->xmlrpc_port_);
}

void EmulatedO3d303::unplug() {
  impl_->run([this] { impl_->closeAll(); });
}
void EmulatedO3d303::plugIn() {
  impl_->run([this] { impl_->listen(); });
}
void EmulatedO3d303::hang() {
  impl_->run([this] { impl_->is_hanging = true; });
}
void EmulatedO3d303::recover() {
  impl_->run([this] { impl_->is_hanging = false; });
}
void EmulatedO3d303::reboot(bool to_factory_settings) {
  impl_->run([this, to_factory_settings] {
    impl_->closeAll();
    to_factory_settings ? impl_->device_.reset() : impl_->device_.restart();
    impl_->is_hanging = false;
    impl_->count_ = 0;
    impl_->clock_begin = std::chrono::seconds{10};
    impl_->timer_.cancel();
    impl_->beginStream();
  });
}
void EmulatedO3d303::dropLine() {
  impl_->run([this] { impl_->reset(); });
}
void EmulatedO3d303::corrupt(int frames, bool framing) {
  impl_->run([&] {
    impl_->corrupt = frames;
    impl_->corrupt_framing = framing;
  });
}
void EmulatedO3d303::garble(int messages) {
  impl_->run([&] { impl_->garble = messages; });
}
int EmulatedO3d303::toGarble() {
  return impl_->run([this] { return impl_->garble; });
}
void EmulatedO3d303::loseFrames(int frames) {
  impl_->run([&] { impl_->lose = frames; });
}
void EmulatedO3d303::setClock(std::chrono::nanoseconds by) {
  impl_->run([&] { impl_->clock_begin += by; });
}
void EmulatedO3d303::withDevice(const std::function<void(O3d303Device&)>& look) {
  impl_->run([&] { look(impl_->device_); });
}
int EmulatedO3d303::connections() {
  return impl_->run(
      [this] { return static_cast<int>(impl_->connections_.size() + impl_->calls_.size()); });
}
int EmulatedO3d303::framesMade() {
  return impl_->run([this] { return impl_->frames_made; });
}

EmulatedO3d303::Pixel EmulatedO3d303::pixelAt(std::uint32_t frame_count, std::uint32_t x,
                                              std::uint32_t y) {
  using o3d303::Confidence;
  const auto distance_mm = static_cast<std::uint16_t>(1000 + 10 * ((x + y + frame_count) % 256));
  const auto amplitude = static_cast<std::uint16_t>(200 + (x + 3 * y) % 128);
  if (x < 16 && y < 16) {  // a corner without values: half of it zero, half invalid with a number
    const bool is_zero = x < 8;
    return {is_zero ? std::uint16_t{0} : distance_mm, amplitude,
            static_cast<std::uint8_t>(is_zero ? Confidence::LowAmplitude : Confidence::Invalid)};
  }
  const bool is_bright = x >= 160 && y < 16;
  return {distance_mm, amplitude,
          is_bright ? static_cast<std::uint8_t>(Confidence::Saturated) : std::uint8_t{0}};
}

}  // namespace toftwin::test
