// SPDX-License-Identifier: Apache-2.0
#include "emulated_rig.h"

#include <fmt/format.h>
#include <modbus/modbus.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <mutex>
#include <netinet/in.h>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

namespace toftwin::test {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kAxes = 2;
constexpr double kNever = std::numeric_limits<double>::infinity();
enum Coil { Stop, Go, Home, Captured, kCoils };
enum Discrete { LoopClosed, Fault, Homed, InPosition, Trigger, kDiscrete };
constexpr int kHeartbeat = 10, kRoom = 20, kFaultCode = 21, kRegisters = 32;
constexpr double kThere = 1e-4;  // so near a motor holds its target

/// A motor that speeds up and brakes evenly, and what it carries.
struct Axis {
  double motor = 0.0, speed = 0.0, load = 0.0, target = 0.0;

  void step(double dt, const EmulatedRig::Options& options, bool is_braking) {
    const double left = is_braking ? 0.0 : target - motor;
    // As fast as can still be braked, v² = 2 a s, with something in hand for the finite steps.
    const double allowed =
        std::min(options.speed, std::sqrt(1.4 * options.acceleration * std::abs(left)));
    const double wanted = std::copysign(allowed, left), most = options.acceleration * dt;
    speed += std::clamp(wanted - speed, -most, most);
    motor += speed * dt;
    if (!is_braking && std::abs(target - motor) < std::max(kThere, most * dt) &&
        std::abs(speed) <= 2.0 * most) {
      motor = target, speed = 0.0;
    }
    load = std::clamp(load, motor - options.backlash / 2.0, motor + options.backlash / 2.0);
  }
};

}  // namespace

class EmulatedRig::Impl {
 public:
  explicit Impl(Options options) : options_(options) {
    context_ = modbus_new_tcp("127.0.0.1", 0);
    mapping_ = modbus_mapping_new(kCoils, kDiscrete, kRegisters, kRegisters);
    if (context_ == nullptr || mapping_ == nullptr) throw std::runtime_error{"libmodbus"};
    modbus_set_indication_timeout(context_, 0, 50'000);  // whoever stalls holds nobody up for long
    modbus_set_byte_timeout(context_, 0, 50'000);
    // modbus_tcp_listen takes no port 0, so the listening socket is our own.
    listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    if (::bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
        ::listen(listener_, 8) != 0 ||
        ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
      throw std::runtime_error{"no port on loopback"};
    }
    port_ = ntohs(address.sin_port);
    mapping_->tab_input_bits[LoopClosed] = 1;
    mapping_->tab_input_bits[Homed] = options_.is_homed ? 1 : 0;
    show();
    thread_ = std::jthread{[this](const std::stop_token& stop) { run(stop); }};
  }
  ~Impl() {
    thread_.request_stop();
    thread_.join();
    for (const int client : clients_) ::close(client);
    if (listener_ >= 0) ::close(listener_);
    modbus_mapping_free(mapping_);
    modbus_free(context_);
  }

  void run(const std::stop_token& stop) {
    auto last = Clock::now();
    while (!stop.stop_requested()) {
      serve();
      const std::scoped_lock lock{mutex_};
      const auto now = Clock::now();
      // Small steps, whatever the machine does to this thread.
      for (; last + std::chrono::milliseconds{1} <= now; last += std::chrono::milliseconds{1})
        move(1e-3);
      show();
    }
  }

  void serve() {
    std::vector<pollfd> ready;
    if (listener_ >= 0) ready.push_back({listener_, POLLIN, 0});
    for (const int client : clients_) ready.push_back({client, POLLIN, 0});
    if (::poll(ready.data(), ready.size(), 1) <= 0) return;
    for (const pollfd& one : ready) {
      if (one.revents == 0) continue;
      if (one.fd == listener_) {
        const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
        if (client >= 0) clients_.push_back(client);
      } else {
        answer(one.fd);
      }
    }
  }
  void answer(int client) {
    std::array<std::uint8_t, MODBUS_TCP_MAX_ADU_LENGTH> request{};
    modbus_set_socket(context_, client);
    const int size = modbus_receive(context_, request.data());
    const std::scoped_lock lock{mutex_};
    if (size < 0 || std::ranges::find(clients_, client) == clients_.end()) return drop(client);
    if (is_silent_ || size == 0) return;
    const bool is_stop = request[7] == MODBUS_FC_WRITE_SINGLE_COIL && request[9] == Stop;
    if (is_refusing_ && !is_stop) {
      modbus_reply_exception(context_, request.data(), MODBUS_EXCEPTION_SLAVE_OR_SERVER_FAILURE);
      return;
    }
    modbus_reply(context_, request.data(), size, mapping_);
    obey();
  }
  void drop(int client) {
    ::close(client);
    std::erase(clients_, client);
  }

  /// Takes over what has just been written.
  void obey() {
    const std::uint16_t* holding = mapping_->tab_registers;
    const auto both = [&](int at, bool low_first) {
      return static_cast<std::uint32_t>(holding[at + (low_first ? 1 : 0)]) << 16 |
             holding[at + (low_first ? 0 : 1)];
    };
    if (mapping_->tab_bits[Go] != 0) {
      mapping_->tab_bits[Go] = 0;
      if (mapping_->tab_bits[Stop] == 0) {
        axes_[0].target = static_cast<double>(std::bit_cast<float>(both(0, false)));
        axes_[1].target = static_cast<std::int32_t>(both(2, true)) * 1e-3;
        is_driven_ = true;
        ++departures_;
      }
    }
    if (mapping_->tab_bits[Home] != 0 && !is_homing_ && mapping_->tab_bits[Stop] == 0) {
      is_homing_ = is_driven_ = true;
      mapping_->tab_input_bits[Homed] = 0;
      for (Axis& axis : axes_) axis.target = 0.0;
    }
    if (mapping_->tab_bits[Home] == 0) is_homing_ = false;
    if (holding[kHeartbeat] != heartbeat_)
      heartbeat_ = holding[kHeartbeat], beat_at_ = Clock::now();
  }

  void move(double dt) {
    if (mapping_->tab_bits[Stop] != 0 || mapping_->tab_input_bits[LoopClosed] == 0 ||
        mapping_->tab_input_bits[Fault] != 0 || isForsaken()) {
      is_driven_ = false;
    }
    for (int i = 0; i < kAxes; ++i) {
      if (i == 0 && axes_[0].motor >= stall_at_) {
        axes_[0].speed = 0.0;
        continue;
      }
      axes_[static_cast<std::size_t>(i)].step(dt, options_, !is_driven_);
    }
    const double x = axes_[0].motor;
    if (x >= drop_at_) {
      drop_at_ = kNever;
      for (const int client : clients_) ::close(client);
      clients_.clear();
      if (is_drop_final_) ::close(std::exchange(listener_, -1));
    }
    is_refusing_ = is_refusing_ || x >= refuse_at_;
    is_silent_ = is_silent_ || x >= silent_at_;
    if (x >= emergency_at_) mapping_->tab_input_bits[LoopClosed] = 0;
    if (x >= fail_at_) mapping_->tab_input_bits[Fault] = 1;
    if (is_homing_ && areThere()) mapping_->tab_input_bits[Homed] = 1;
  }
  [[nodiscard]] bool isForsaken() const {
    return options_.stop_without_heartbeat_s > 0.0 && is_driven_ && !is_homing_ &&
           Clock::now() - beat_at_ >
               std::chrono::duration<double>{options_.stop_without_heartbeat_s};
  }
  [[nodiscard]] bool areThere() const {
    return std::ranges::all_of(
        axes_, [](const Axis& axis) { return axis.motor == axis.target && axis.speed == 0.0; });
  }

  /// What can be read.
  void show() {
    std::uint16_t* input = mapping_->tab_input_registers;
    const auto x = std::bit_cast<std::uint32_t>(static_cast<float>(axes_[0].motor));
    const auto turn =
        static_cast<std::uint32_t>(static_cast<std::int32_t>(std::lround(axes_[1].motor * 1e3)));
    input[0] = static_cast<std::uint16_t>(x >> 16);
    input[1] = static_cast<std::uint16_t>(x);
    input[2] = static_cast<std::uint16_t>(turn);
    input[3] = static_cast<std::uint16_t>(turn >> 16);
    mapping_->tab_input_bits[InPosition] = areThere() ? 1 : 0;
  }

  Options options_;
  modbus_t* context_ = nullptr;
  modbus_mapping_t* mapping_ = nullptr;
  int listener_ = -1;
  std::uint16_t port_ = 0;
  std::vector<int> clients_;

  std::mutex mutex_;  // guards what follows and the mapping
  std::array<Axis, kAxes> axes_;
  bool is_driven_ = false, is_homing_ = false, is_refusing_ = false, is_silent_ = false,
       is_drop_final_ = false;
  int departures_ = 0;
  std::uint16_t heartbeat_ = 0;
  Clock::time_point beat_at_ = Clock::now();
  double stall_at_ = kNever, drop_at_ = kNever, refuse_at_ = kNever, silent_at_ = kNever,
         emergency_at_ = kNever, fail_at_ = kNever;
  std::jthread thread_;  // last: it uses all of the above
};

EmulatedRig::EmulatedRig(Options options) : impl_(std::make_unique<Impl>(options)) {}
EmulatedRig::~EmulatedRig() = default;

std::string EmulatedRig::file(const std::string& more) const {
  return fmt::format(R"(host = "127.0.0.1"
port = {}
answer_time_ms = 200
poll_ms = 2
settle_ms = 20
stall_time_ms = 150
move_time_s = 5.0
home_time_s = 5.0
{}
stop = {{memory = "coil", address = 0}}
go = {{memory = "coil", address = 1}}
home = {{memory = "coil", address = 2}}
captured = {{memory = "coil", address = 3}}
emergency = {{memory = "discrete", address = 0, inverted = true}}
fault = {{memory = "discrete", address = 1}}
homed = {{memory = "discrete", address = 2}}
in_position = {{memory = "discrete", address = 3}}
trigger = {{memory = "discrete", address = 4}}
heartbeat = {{memory = "holding", address = 10, number = "u16"}}
fault_code = {{memory = "input", address = 21, number = "u16"}}

[[axis]]
name = "x"
direction = [1.0, 0.0, 0.0]
min = -100.0
max = 400.0
tolerance = 0.05
target = {{memory = "holding", address = 0, number = "f32"}}
position = {{memory = "input", address = 0, number = "f32"}}

[[axis]]
name = "turn"
kind = "rotary"
direction = [0.0, 1.0, 0.0]
point_m = [0.0, 0.0, 1.0]
min = -170.0
max = 170.0
tolerance = 0.01
target = {{memory = "holding", address = 2, number = "s32", words = "low_first", scale = 0.001}}
position = {{memory = "input", address = 2, number = "s32", words = "low_first", scale = 0.001}}

[[temperature]]
name = "room"
signal = {{memory = "input", address = 20, scale = 0.1}}
)",
                     impl_->port_, more);
}
std::filesystem::path EmulatedRig::writeFile(const std::string& more) const {
  const auto path = std::filesystem::temp_directory_path() /
                    fmt::format("toftwin-rig-{}-{}.toml", ::getpid(), impl_->port_);
  std::ofstream{path} << file(more);
  return path;
}

double EmulatedRig::load(int axis) {
  const std::scoped_lock lock{impl_->mutex_};
  return impl_->axes_.at(static_cast<std::size_t>(axis)).load;
}
bool EmulatedRig::isMoving() {
  const std::scoped_lock lock{impl_->mutex_};
  return std::ranges::any_of(impl_->axes_, [](const Axis& axis) { return axis.speed != 0.0; });
}
bool EmulatedRig::isStopped() {
  const std::scoped_lock lock{impl_->mutex_};
  return impl_->mapping_->tab_bits[Stop] != 0;
}
bool EmulatedRig::isHoming() {
  const std::scoped_lock lock{impl_->mutex_};
  return impl_->is_homing_;
}
int EmulatedRig::departures() {
  const std::scoped_lock lock{impl_->mutex_};
  return impl_->departures_;
}
void EmulatedRig::leaveCaptured() {
  const std::scoped_lock lock{impl_->mutex_};
  impl_->mapping_->tab_bits[Captured] = 1;
}

bool EmulatedRig::isCaptured() {
  const std::scoped_lock lock{impl_->mutex_};
  return impl_->mapping_->tab_bits[Captured] != 0;
}
void EmulatedRig::stallAt(double x) {
  const std::scoped_lock lock{impl_->mutex_};
  impl_->stall_at_ = x;
}
void EmulatedRig::dropLineAt(double x, bool for_ever) {
  const std::scoped_lock lock{impl_->mutex_};
  impl_->drop_at_ = x;
  impl_->is_drop_final_ = for_ever;
}
void EmulatedRig::refuseAt(double x) {
  const std::scoped_lock lock{impl_->mutex_};
  impl_->refuse_at_ = x;
}
void EmulatedRig::fallSilentAt(double x) {
  const std::scoped_lock lock{impl_->mutex_};
  impl_->silent_at_ = x;
}
void EmulatedRig::pressEmergencyAt(double x) {
  const std::scoped_lock lock{impl_->mutex_};
  impl_->emergency_at_ = x;
}
void EmulatedRig::failAt(double x, int code) {
  const std::scoped_lock lock{impl_->mutex_};
  impl_->fail_at_ = x;
  impl_->mapping_->tab_input_registers[kFaultCode] = static_cast<std::uint16_t>(code);
}
void EmulatedRig::pressEmergency(bool is_pressed) {
  const std::scoped_lock lock{impl_->mutex_};
  impl_->mapping_->tab_input_bits[LoopClosed] = is_pressed ? 0 : 1;
}
void EmulatedRig::setTrigger(bool is_set) {
  const std::scoped_lock lock{impl_->mutex_};
  impl_->mapping_->tab_input_bits[Trigger] = is_set ? 1 : 0;
}
void EmulatedRig::setTemperature(double celsius) {
  const std::scoped_lock lock{impl_->mutex_};
  impl_->mapping_->tab_input_registers[kRoom] =
      static_cast<std::uint16_t>(static_cast<std::int16_t>(std::lround(celsius * 10.0)));
}

}  // namespace toftwin::test
