// SPDX-License-Identifier: Apache-2.0
// How long it takes from a controller's pose to the frame from there, by three languages, beside the same
// frame made without a daemon.
//   pose_latency_bench [ROUNDS]       default 500
// One small simulated camera that waits for triggers (176 × 132 pixels, one sample). Each round takes a frame
// each way, from a new pose, in turn. The daemon's part has threads of its own in this process, and real
// sockets.
//   native    setPose, trigger, Subscription::next
//   ros2      a PoseStamped that triggers, until Fast DDS has the depth image
//   modbus    six numbers, apply_pose, trigger, until their coils read 0 again
// First: libmodbus makes ON and OFF macros.
#include "tests/daemon/facades/ros2_reader.h"

#include <modbus/modbus.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <toftwin/client.h>

#include "daemon/daemon.h"
#include "daemon/facades/modbus/registers.h"
#include "drivers/source.h"
#include "protocol/settings/settings.h"

namespace toftwin {
namespace {

using namespace std::chrono_literals;
using daemon::modbus::Item;
using test::dds::DataReader;
using test::dds::DataWriter;

constexpr auto kLong = 30s;
constexpr const char* kCamera =
    "uri = 'sim:o3d303_binned'\nsamples_per_pixel = 1\nmax_surfaces = 1\npace = 'trigger'\n";

[[noreturn]] void giveUp(const std::string& what) {
  std::fprintf(stderr, "pose_latency_bench: %s\n", what.c_str());
  std::exit(1);
}
void check(const Result<>& done) {
  if (!done) giveUp(done.error().message);
}
template <class T>
T orGiveUp(Result<T> result) {
  if (!result) giveUp(result.error().message);
  return std::move(*result);
}

/// A little aside of the last, so that no frame is that of the pose before.
Transform<World, Camera> poseOf(int round) {
  return {{1.0, 0.0, 0.0, 0.0}, {0.0625 * (round % 4), 0.0, -0.125 * (round % 3)}};
}
bool isFrom(const Frame& frame, const Transform<World, Camera>& pose) {
  return frame.moment.world_from_camera == pose;
}

/// The camera without a daemon.
class Rendering {
 public:
  Rendering() {
    auto keys = orGiveUp(settings::Table::parse(kCamera, "bench.toml"));
    const auto driver =
        std::ranges::find(drivers::allDrivers(), std::string_view{"sim"}, &drivers::Driver::name);
    camera_ = orGiveUp(driver->open(keys));
    check(camera_->start());
  }
  void take(const Transform<World, Camera>& pose) {
    check(camera_->setPose(pose));
    check(camera_->trigger());
    if (!isFrom(orGiveUp(camera_->next({}, false)), pose)) giveUp("the frame is from elsewhere");
  }

 private:
  std::unique_ptr<drivers::Source> camera_;
};

/// A daemon with one camera for each language, so that none makes frames for another.
class Daemon {
 public:
  Daemon(int domain, int port) {
    std::string config;
    for (const std::string name : {"native", "ros2", "modbus"}) {
      config += fmt::format("[[source]]\nname = '{}'\ndriver = 'sim'\n{}", name, kCamera);
    }
    config += fmt::format(
        "[[facade]]\nkind = 'ros2'\nsource = 'ros2'\nname = 'cam'\ndomain = {}\npose_topic = '/pose'\n"
        "trigger_on_pose = true\n[[facade]]\nkind = 'modbus'\nsource = 'modbus'\nport = {}\n",
        domain, port);
    std::ofstream{folder_ / "toftwind.toml"} << config;
    daemon_ = orGiveUp(daemon::Daemon::start(
        {.config = folder_ / "toftwind.toml", .port = 0, .socket = (folder_ / "socket").string()}));
    thread_ = std::thread{[this] { daemon_->run(); }};
  }
  ~Daemon() {
    daemon_->stop();
    thread_.join();
    std::filesystem::remove_all(folder_);
  }
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;
  [[nodiscard]] std::string address() const { return "unix:" + daemon_->socketPath(); }

 private:
  static std::filesystem::path makeFolder() {
    std::string pattern = std::filesystem::temp_directory_path() / "pose_latency_XXXXXX";
    if (::mkdtemp(pattern.data()) == nullptr) giveUp("no folder in " + pattern);
    return pattern;
  }
  const std::filesystem::path folder_ = makeFolder();
  std::unique_ptr<daemon::Daemon> daemon_;
  std::thread thread_;
};

class Native {
 public:
  explicit Native(const std::string& address) : client_(orGiveUp(Client::connect(address))) {}
  void take(const Transform<World, Camera>& pose) {
    check(client_.setPose("native", pose));
    check(client_.trigger("native"));
    if (!isFrom(orGiveUp(frames_.next(kLong)), pose)) giveUp("native: the frame is from elsewhere");
  }

 private:
  Client client_;
  Subscription frames_ =
      orGiveUp(client_.subscribe("native", {.policy = SubscribeOptions::Policy::Queue, .queue = 8}));
};

class Ros {
 public:
  explicit Ros(int domain)
      : program_(domain),
        images_(program_.read("/cam/depth/image_raw", "sensor_msgs::msg::dds_::Image_")),
        poses_(program_.write("/pose", "geometry_msgs::msg::dds_::PoseStamped_")) {
    for (auto left = kLong / 10ms; !isThere(); --left) {
      if (left == 0) giveUp("ros2: the daemon is not found");
      std::this_thread::sleep_for(10ms);
    }
  }
  void take(const Transform<World, Camera>& pose) {
    test::CdrWriter message;
    message.number<std::int32_t>(0).number<std::uint32_t>(0).text("world");
    const auto& [w, x, y, z] = pose.rotation_wxyz;
    const Vec3d& at = pose.translation_m;
    for (const double one : {at.x, at.y, at.z, x, y, z, w}) message.number(one);
    poses_->write(&message.bytes());
    if (!test::nextOf(images_)) giveUp("ros2: no image");
  }

 private:
  bool isThere() {
    test::dds::PublicationMatchedStatus read;
    test::dds::SubscriptionMatchedStatus written;
    poses_->get_publication_matched_status(read);
    images_->get_subscription_matched_status(written);
    return read.current_count > 0 && written.current_count > 0;
  }
  test::RosProgram program_;
  DataReader* images_;
  DataWriter* poses_;
};

class Plc {
 public:
  explicit Plc(int port) : line_(modbus_new_tcp("127.0.0.1", port)) {
    if (modbus_connect(line_) != 0) giveUp("modbus: no connection");
    modbus_set_response_timeout(line_, 30, 0);
  }
  ~Plc() {
    modbus_close(line_);
    modbus_free(line_);
  }
  Plc(const Plc&) = delete;
  Plc& operator=(const Plc&) = delete;
  void take(const Transform<World, Camera>& pose) {
    std::array<std::uint16_t, 12> words{};
    const Vec3d& at = pose.translation_m;
    std::size_t next = 0;
    for (const double one : {at.x, at.y, at.z}) {
      const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(one));
      words[next++] = static_cast<std::uint16_t>(bits >> 16);
      words[next++] = static_cast<std::uint16_t>(bits);
    }
    if (modbus_write_registers(line_, addressOf(Item::PoseX), 12, words.data()) != 12)
      giveUp("modbus: no pose");
    doIt(Item::ApplyPose);
    doIt(Item::Trigger);
    const auto before = std::exchange(frames_, frames());
    if (before > 0 && frames_ != before + 1) giveUp("modbus: the trigger made no frame");
  }

 private:
  static int addressOf(Item item) {
    return daemon::modbus::registerMap()[static_cast<std::size_t>(item)].address;
  }
  /// So far; fewer than 65,536 here.
  std::uint16_t frames() {
    std::array<std::uint16_t, 2> words{};
    if (modbus_read_input_registers(line_, addressOf(Item::Frames), 2, words.data()) != 2)
      giveUp("modbus: no count");
    return words[1];
  }
  void doIt(Item item) {
    const int at = addressOf(item);
    if (modbus_write_bit(line_, at, 1) != 1) giveUp("modbus: a coil is refused");
    for (std::uint8_t is_busy = 1; is_busy != 0;) {
      if (modbus_read_bits(line_, at, 1, &is_busy) != 1) giveUp("modbus: no answer");
    }
  }
  modbus_t* line_;
  std::uint16_t frames_ = 0;
};

double millisecondsOf(const std::function<void()>& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
}

double shareOf(std::vector<double> values, double share) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

struct Way {
  const char* name;
  std::function<void(const Transform<World, Camera>&)> take;
  std::vector<double> times_ms{}, ratios{};
};

void measure(std::vector<Way>& ways, int rounds) {
  constexpr int kWarm = 20;
  for (int round = -kWarm; round < rounds; ++round) {
    std::vector<double> times(ways.size());
    for (std::size_t i = 0; i < ways.size(); ++i) {
      const std::size_t turn = (i + static_cast<std::size_t>(round + kWarm)) % ways.size();
      times[turn] = millisecondsOf([&] { ways[turn].take(poseOf(round + kWarm)); });
    }
    if (round < 0) continue;
    for (std::size_t i = 0; i < ways.size(); ++i) {
      ways[i].times_ms.push_back(times[i]);
      ways[i].ratios.push_back(times[i] / times[0]);
    }
  }
}

void print(const std::vector<Way>& ways, int rounds) {
  std::array<double, 1> load{};
  ::getloadavg(load.data(), 1);
  fmt::print("{} rounds, load {:.1f}\n", rounds, load[0]);
  fmt::print("{:<10} {:>8} {:>8} {:>8}   of rendering, p50\n", "", "p50 [ms]", "p95", "p99");
  for (const Way& way : ways) {
    fmt::print("{:<10} {:>8.2f} {:>8.2f} {:>8.2f}   {:.2f}\n", way.name, shareOf(way.times_ms, 0.5),
               shareOf(way.times_ms, 0.95), shareOf(way.times_ms, 0.99), shareOf(way.ratios, 0.5));
  }
}

void run(int rounds) {
  spdlog::set_level(spdlog::level::err);
  const int domain = 1 + ::getpid() % 90, port = 20'000 + ::getpid() % 10'000;
  Rendering rendering;
  const Daemon daemon{domain, port};
  Native native{daemon.address()};
  Ros ros{domain};
  Plc plc{port};
  std::vector<Way> ways{{"rendering", [&](const auto& pose) { rendering.take(pose); }},
                        {"native", [&](const auto& pose) { native.take(pose); }},
                        {"ros2", [&](const auto& pose) { ros.take(pose); }},
                        {"modbus", [&](const auto& pose) { plc.take(pose); }}};
  measure(ways, rounds);
  print(ways, rounds);
}

}  // namespace
}  // namespace toftwin

int main(int argc, char** argv) {
  const int rounds = argc > 1 ? std::atoi(argv[1]) : 500;
  if (rounds < 1) toftwin::giveUp("ROUNDS must be at least 1");
  toftwin::run(rounds);
  return 0;
}
