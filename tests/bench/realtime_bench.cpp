// SPDX-License-Identifier: Apache-2.0
// A Kinect v2 in real time: 512 × 424 pixels, 3 frequencies × 3 steps, emitter shadow, multipath, lens scatter,
// distortion and noise, in a closed room of 4 × 2.5 × 5 m with a bumpy sphere of 100,000 triangles that moves
// by 0.3 m/s.
//   realtime_bench [frames|stages|errors|costs|triangles]    default: all
// frames: what a client of the daemon gets. stages: where a frame's time goes. errors: light against 65,536
// samples of the unbiased tracer, and beside the camera's noise. costs, triangles: how time and memory grow.
#include <fmt/format.h>
#include <malloc.h>
#include <signal.h>
#include <spdlog/spdlog.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <numbers>

#include <toftwin/client.h>

#include "daemon/clock.h"
#include "daemon/hub.h"
#include "daemon/memory.h"
#include "daemon/server.h"
#include "daemon/source_host.h"
#include "drivers/sim/simulator.h"
#include "sim/sensor/frame_assembly.h"
#include "sim/sensor/sensor_model.h"
#include "sim/tracer/realtime.h"

namespace {

using namespace toftwin;
using namespace toftwin::sim;
using namespace std::chrono_literals;

constexpr Duration kInterval = 33.333333_ms;

[[noreturn]] void giveUp(const std::string& what) {
  fmt::print(stderr, "realtime_bench: {}\n", what);
  std::exit(1);
}

template <class T>
T orGiveUp(Result<T> result) {
  if (!result) giveUp(result.error().message);
  return *std::move(result);
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::ranges::sort(values);
  return values[std::min(values.size() - 1, static_cast<std::size_t>(share * static_cast<double>(values.size())))];
}
double median(const std::vector<double>& values) { return quantile(values, 0.5); }

double wallMs() {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
double processorMs() { return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// A sphere of radius 0.6 m with bumps, 2 · steps² triangles, as a binary PLY file.
void writeBumpySphere(const std::filesystem::path& file, int steps) {
  std::ofstream out{file, std::ios::binary};
  out << fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"
                     "property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
                     (steps + 1) * steps, 2 * steps * steps);
  for (int i = 0; i <= steps; ++i) {
    for (int j = 0; j < steps; ++j) {
      const double theta = std::numbers::pi * i / steps, phi = 2.0 * std::numbers::pi * j / steps;
      const double r = 0.6 * (1.0 + 0.05 * std::sin(12.0 * theta) * std::sin(12.0 * phi));
      const float at[] = {static_cast<float>(r * std::sin(theta) * std::cos(phi)),
                          static_cast<float>(r * std::sin(theta) * std::sin(phi)),
                          static_cast<float>(r * std::cos(theta))};
      out.write(reinterpret_cast<const char*>(at), sizeof at);
    }
  }
  for (int i = 0; i < steps; ++i) {
    for (int j = 0; j < steps; ++j) {
      const int a = i * steps + j, b = i * steps + (j + 1) % steps;
      for (const auto& corners : {std::array{a, b, b + steps}, std::array{a, b + steps, a + steps}}) {
        out.put(3);
        out.write(reinterpret_cast<const char*>(corners.data()), sizeof corners);
      }
    }
  }
}

/// The room, the camera and the configuration in a folder of their own.
class Files {
 public:
  explicit Files(int steps = 224)
      : folder_(std::filesystem::temp_directory_path() / fmt::format("toftwin_realtime_bench_{}", ::getpid())) {
    std::filesystem::create_directories(folder_);
    writeBumpySphere(folder_ / "bumpy.ply", steps);
    std::ofstream{scene()} << R"(
      [[material]]
      name = "white"
      albedo = 0.8
      [[object]]
      shape = "box"
      size_m = [4, 2.5, 5]
      position_m = [0, 0, 2]
      material = "white"
      [[object]]
      mesh = "bumpy.ply"
      material = "white"
      period_s = 2.0
      [[object.keyframe]]
      time_s = 0.0
      position_m = [0.05, 0.1, 2.2]
      [[object.keyframe]]
      time_s = 1.0
      position_m = [0.35, 0.1, 2.2]
      [[object.keyframe]]
      time_s = 2.0
      position_m = [0.05, 0.1, 2.2]
      )";
    std::ofstream{camera()} << orGiveUp(SensorModel::presetText("kinect_v2"))
                            << "\n[[effect]]\ntype = \"lens_scatter\"\nveil = 0.01\nhalo = 0.02\nhalo_radius_px = 15\n";
  }
  ~Files() { std::filesystem::remove_all(folder_); }
  Files(const Files&) = delete;
  Files& operator=(const Files&) = delete;

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  [[nodiscard]] std::filesystem::path scene() const { return folder_ / "room.toml"; }
  [[nodiscard]] std::filesystem::path camera() const { return folder_ / "camera.toml"; }

 private:
  std::filesystem::path folder_;
};

// ---- through the daemon ---------------------------------------------------------------------------------

/// The daemon's part, in a process of its own: the simulated camera as fast as it goes, or at its pace.
pid_t startDaemon(const Files& files, const std::string& socket, const std::string& pace) {
  const pid_t pid = ::fork();
  if (pid != 0) return pid;
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  spdlog::set_level(spdlog::level::off);
  const auto open = [&] {
    auto table = orGiveUp(settings::Table::parse(
        fmt::format("camera = 'camera.toml'\nscene = 'room.toml'\nmode = 'realtime'\nmax_surfaces = 16\npace = '{}'\n", pace),
        files.folder() / "toftwind.toml"));
    return drivers::simulator::row().open(table);
  };
  daemon::Hub hub{{}, daemon::systemClock()};
  hub.add(std::make_shared<daemon::SourceHost>("cam", open, open(), daemon::SourceHost::Options{}, daemon::systemClock()));
  boost::asio::io_context io;
  daemon::Server server{io, hub, {}};
  if (auto listening = server.listenUnix(socket); !listening) giveUp(listening.error().message);
  io.run();
  ::_exit(0);
}

void measureFrames(const Files& files, const std::string& pace, double seconds) {
  const std::string socket = files.folder() / (pace + ".sock");
  const pid_t daemon = startDaemon(files, socket, pace);
  for (int i = 0; i < 200 && !std::filesystem::exists(socket); ++i) ::usleep(50'000);
  auto client = orGiveUp(Client::connect("unix:" + socket));
  auto subscription = orGiveUp(client.subscribe("cam"));
  std::vector<double> intervals, latencies;
  std::uint64_t lost = 0;
  double last = 0.0;
  const double end = wallMs() + 1e3 * seconds;
  for (int i = 0; wallMs() < end; ++i) {
    const auto frame = subscription.next(5s);
    if (!frame) giveUp(frame.error().message);
    const double now = wallMs();
    if (i > 40) {
      intervals.push_back(now - last);
      lost += frame->dropped_before + frame->dropped_by_device;
    }
    last = now;
  }
  ::kill(daemon, SIGKILL);
  ::waitpid(daemon, nullptr, 0);
  double sum = 0.0;
  for (const double interval : intervals) sum += interval;
  fmt::print("| {} | {} | {:.1f} | {:.1f} | {:.1f} | {} |\n", pace, intervals.size(),
             1e3 * static_cast<double>(intervals.size()) / sum, median(intervals), quantile(intervals, 0.95), lost);
}

void frames(const Files& files) {
  fmt::print("\nFrames that a client of the daemon gets over a Unix socket and shared memory: range, depth, amplitude, ambient,\n"
             "flags. Pace fast: as many as can be; real_time: 30 a second, so that lost ones count.\n\n"
             "| pace | frames | frames/s | interval p50 [ms] | p95 | lost |\n| --- | --- | --- | --- | --- | --- |\n");
  measureFrames(files, "fast", 12.0);
  measureFrames(files, "real_time", 12.0);
}

// ---- in this process --------------------------------------------------------------------------------------

/// The camera frame after frame, as the driver runs it.
class Kinect {
 public:
  explicit Kinect(const Files& files, std::uint64_t seed = 1)
      : model(orGiveUp(SensorModel::load(files.camera()))), scene(orGiveUp(Scene::load(files.scene()))), seed_(seed) {
    request = model.traceRequest();
    request.max_surfaces = 16;
    request.seed = seed;
    wanted_ = model.correlatedTerms();
  }
  [[nodiscard]] Duration time() const { return static_cast<double>(frame) * kInterval; }
  [[nodiscard]] Moment moment() const {
    Moment moment;
    moment.exposures = model.exposures({static_cast<std::int64_t>(time().in(nanosecond))});
    moment.since_power_on = 10'800_s;
    return moment;
  }
  const Light& trace() { return *(light = &tracer.next(scene.at(time()), request, wanted_)); }
  [[nodiscard]] Samples collect(const SensorModel& with) const { return with.collect(*light, moment(), seed_, frame); }
  [[nodiscard]] SensorModel::Exposed readOut(const SensorModel& with, Samples samples, std::uint64_t noise) const {
    return with.readOut(std::move(samples), moment(), seed_, noise);
  }

  SensorModel model;
  Scene scene;
  TraceRequest request;
  RealtimeTracer tracer;
  const Light* light = nullptr;
  std::uint64_t frame = 0;

 private:
  std::uint64_t seed_;
  std::vector<std::uint8_t> wanted_;
};

void stages(const Files& files) {
  Kinect kinect{files};
  const auto planes = allPlanes();
  std::vector<std::vector<double>> wall(5), processor(5);
  for (; kinect.frame < 90; ++kinect.frame) {
    double w = wallMs(), p = processorMs(), w0 = w, p0 = p;
    const auto done = [&](std::size_t stage) {
      if (kinect.frame > 5) {
        wall[stage].push_back(wallMs() - w);
        processor[stage].push_back(processorMs() - p);
      }
      w = wallMs();
      p = processorMs();
    };
    kinect.trace();
    done(0);
    Samples samples = kinect.collect(kinect.model);
    done(1);
    auto exposed = kinect.readOut(kinect.model, std::move(samples), kinect.frame);
    done(2);
    const auto made = planesOf(kinect.model, std::move(exposed), kinect.light->truth, planes.subspan(0, 5));
    done(3);
    w = w0;
    p = p0;
    done(4);
  }
  fmt::print("\nWhere a frame's time goes, medians of {} frames [ms]:\n\n| stage | by the clock | processor |\n| --- | --- | --- |\n",
             wall[0].size());
  const char* names[] = {"light: realtime tracer", "collect: scatter and correlation", "read out: noise, decoder, filters", "planes", "all"};
  for (std::size_t i = 0; i < 5; ++i) fmt::print("| {} | {:.1f} | {:.1f} |\n", names[i], median(wall[i]), median(processor[i]));
}

/// The same camera without noise and filters that hide it.
SensorModel withoutNoise(const SensorModel& model) {
  std::vector<AnyEffect> effects;
  for (const AnyEffect& effect : model.effects()) {
    if (std::holds_alternative<ShotNoise>(effect) || std::holds_alternative<ReadNoise>(effect) ||
        std::holds_alternative<RangeNoise>(effect) || std::holds_alternative<Companding>(effect)) {
      continue;
    }
    effects.push_back(effect);
  }
  return model.withEffects(std::move(effects));
}

double rangeApart(std::complex<float> a, std::complex<float> b, Frequency f) {
  const double phase = std::arg(std::complex<double>{a} * std::conj(std::complex<double>{b}));
  return std::abs(phase) * kSpeedOfLight_m_per_s / (4.0 * std::numbers::pi * f.in(hertz)) * 1e3;
}

double millimetresOf(double variance, std::complex<float> phasor, Frequency f) {
  return std::sqrt(variance) / static_cast<double>(std::abs(phasor)) * kSpeedOfLight_m_per_s /
         (4.0 * std::numbers::pi * f.in(hertz)) * 1e3;
}

/// Multipath's error against converged light, at pixels spread over the image, at the first frequency.
void judge(const Kinect& kinect) {
  TraceRequest what = kinect.request;
  what.samples_per_pixel = 65'536;
  what.region_width = what.region_height = 1;
  TraceRequest direct = what;
  direct.max_surfaces = 1;
  direct.samples_per_pixel = 64;
  const Frequency f = what.frequencies[0];
  std::vector<double> errors, without, sigmas, references, deviations;
  const Scene posed = kinect.scene.at(kinect.time());
  for (what.region_y = 9; what.region_y < what.camera.height; what.region_y += 37) {
    for (what.region_x = 7; what.region_x < what.camera.width; what.region_x += 41) {
      const int x = direct.region_x = what.region_x, y = direct.region_y = what.region_y;
      const Light reference = trace(posed, what);
      const std::complex<float> exact = reference.phasors[0][0], seen = kinect.light->phasors[0](x, y);
      errors.push_back(rangeApart(seen, exact, f));
      without.push_back(rangeApart(trace(posed, direct).phasors[0][0], exact, f));
      sigmas.push_back(millimetresOf(static_cast<double>(kinect.light->variance[0](x, y)), seen, f));
      references.push_back(millimetresOf(static_cast<double>(reference.variance[0][0]), exact, f));
      deviations.push_back(errors.back() / std::hypot(sigmas.back(), references.back()));
    }
  }
  const auto share = [&](const std::vector<double>& values, double below) {
    return 100.0 * static_cast<double>(std::ranges::count_if(values, [&](double v) { return v < below; })) /
           static_cast<double>(values.size());
  };
  fmt::print("| multipath's error at {:.0f} MHz, {} pixels: median, 90 % | {:.2f}, {:.2f} mm |\n", f.in(megahertz),
             errors.size(), median(errors), quantile(errors, 0.9));
  fmt::print("| without multipath: median | {:.2f} mm |\n", median(without));
  fmt::print("| the reference's own σ: median, largest | {:.2f}, {:.2f} mm |\n", median(references),
             quantile(references, 1.0));
  fmt::print("| σ as stated with the frame: median, 90 % | {:.2f}, {:.2f} mm |\n", median(sigmas), quantile(sigmas, 0.9));
  fmt::print("| error within 1, 2, 3 σ as stated | {:.0f}, {:.0f}, {:.0f} % |\n", share(deviations, 1.0),
             share(deviations, 2.0), share(deviations, 3.0));
}

/// Pixel by pixel over a few readings: the standard deviation of the range that the camera's noise makes.
Image<float> cameraNoise(const Kinect& kinect) {
  constexpr int kReadings = 24;
  const Samples samples = kinect.collect(kinect.model);
  Image<float> sum{512, 424}, squares{512, 424};
  for (int i = 0; i < kReadings; ++i) {
    const auto exposed = kinect.readOut(kinect.model, samples, 1000 + static_cast<std::uint64_t>(i));
    for (std::size_t p = 0; p < sum.size(); ++p) {
      const float range = exposed.range.range_m[p];
      sum[p] += range;
      squares[p] += range * range;
    }
  }
  Image<float> sigma{512, 424};
  for (std::size_t p = 0; p < sum.size(); ++p) {
    const double mean = static_cast<double>(sum[p]) / kReadings, square = static_cast<double>(squares[p]) / kReadings;
    sigma[p] = static_cast<float>(std::sqrt(std::max(0.0, square - mean * mean) * kReadings / (kReadings - 1)));
  }
  return sigma;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  double aa = 0.0, bb = 0.0, ab = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    aa += a[i] * a[i];
    bb += b[i] * b[i];
    ab += a[i] * b[i];
  }
  return ab / std::sqrt(aa * bb);
}

void errors(const Files& files) {
  Kinect a{files, 1}, b{files, 77};
  const SensorModel quiet = withoutNoise(a.model);
  for (; a.frame < 89; ++a.frame, ++b.frame) {
    a.trace();
    b.trace();
  }
  // What two runs differ by that share nothing but scene and camera is √2 times one's own error.
  std::vector<std::vector<double>> light_apart, all_apart;
  for (int i = 0; i < 2; ++i) {
    if (i > 0) ++a.frame, ++b.frame;
    a.trace();
    b.trace();
    const auto apart = [&](const SensorModel& model) {
      const auto x = a.readOut(model, a.collect(model), a.frame).range.range_m;
      const auto y = b.readOut(model, b.collect(model), b.frame).range.range_m;
      std::vector<double> differences;
      for (std::size_t p = 0; p < x.size(); ++p) {
        const double d = static_cast<double>(x[p]) - static_cast<double>(y[p]);
        differences.push_back(std::abs(d) < 0.1 ? d : 0.0);  // not where unwrapping failed or nothing is
      }
      return differences;
    };
    light_apart.push_back(apart(quiet));
    all_apart.push_back(apart(a.model));
  }
  fmt::print("\nErrors after three seconds:\n\n| what | |\n| --- | --- |\n");
  judge(a);
  const Image<float> noise = cameraNoise(a);
  double below = 0.0, seen = 0.0;
  std::vector<double> own, cameras;
  for (std::size_t p = 0; p < noise.size(); ++p) {
    if (!(noise[p] > 0.0f)) continue;
    seen += 1.0;
    own.push_back(std::abs(light_apart[1][p]) / std::numbers::sqrt2 * 1e3);
    cameras.push_back(1e3 * static_cast<double>(noise[p]));
    below += own.back() < cameras.back() ? 1.0 : 0.0;
  }
  fmt::print("| the camera's noise in the range: median σ | {:.2f} mm |\n| the light's own: median, 99 % of pixels | {:.2f}, {:.2f} mm |\n"
             "| pixels where the light's own is below the camera's | {:.2f} % |\n"
             "| correlation of successive frames: light alone, whole frames | {:.3f}, {:.4f} |\n",
             median(cameras), median(own), quantile(own, 0.99), 100.0 * below / seen, correlation(light_apart[0], light_apart[1]),
             correlation(all_apart[0], all_apart[1]));
}

// ---- how costs grow ---------------------------------------------------------------------------------------

double medianOf(int runs, const std::function<void()>& work) {
  std::vector<double> times;
  for (int i = 0; i < runs; ++i) {
    const double start = processorMs();
    work();
    times.push_back(processorMs() - start);
  }
  return median(times);
}

std::size_t bytesInUse() {
  const auto info = ::mallinfo2();
  return info.uordblks + info.hblkhd;
}

void costs(const Files& files) {
  const double start = wallMs();
  Kinect kinect{files};
  const std::size_t loaded = bytesInUse();
  const double first = wallMs();
  kinect.trace();
  fmt::print("\nCold start to the first frame's light: {:.0f} ms, {:.0f} of them to load\n", wallMs() - start, first - start);
  for (int i = 0; i < 3; ++i) kinect.trace();
  fmt::print("Real time: {:.0f} bytes per pixel, all cells and grids included, {} phasors\n",
             static_cast<double>(bytesInUse() - loaded) / (512.0 * 424.0),
             std::ranges::count_if(kinect.light->phasors, [](const auto& image) { return !image.empty(); }));
  int posed = 0;
  const double nine = medianOf(20, [&] {
    for (int exposure = 0; exposure < 9; ++exposure) static_cast<void>(kinect.scene.at(++posed * 3.7_ms));
  });
  TraceRequest direct = kinect.request;
  direct.harmonics = 1;
  direct.max_surfaces = direct.samples_per_pixel = 1;
  fmt::print("Nine raw exposures, each with the sphere in its own place: {:.2f} ms to pose; direct light for each:\n", nine);
  Light light;
  const auto reposed = [&](const char* how, const std::function<void(const Scene&)>& expose) {
    expose(kinect.scene);
    const double wall = wallMs(), processor = processorMs();
    for (int exposure = 0; exposure < 45; ++exposure) expose(kinect.scene.at(++posed * 3.7_ms));
    fmt::print("  {}: {:.1f} frames/s, {:.1f} ms of processor time an exposure\n", how, 5e3 / (wallMs() - wall),
               (processorMs() - processor) / 45.0);
  };
  reposed("trace(), one sample a pixel", [&](const Scene& scene) { light = trace(scene, direct, std::move(light)); });
  reposed("RealtimeTracer, pixels' centres and footprints where depth jumps",
          [&](const Scene& scene) { kinect.tracer.next(scene, direct); });
  TraceRequest what = direct;
  fmt::print("\nUnbiased, processor time relative to the first row (proportion expected):\n\n| pixels | samples | surfaces | time | work |\n"
             "| --- | --- | --- | --- | --- |\n");
  double unit = 0.0;
  for (const auto& [width, height, samples, surfaces] : {std::array{256, 212, 4, 2}, std::array{512, 424, 4, 2}, std::array{512, 424, 16, 2},
                                                         std::array{256, 212, 4, 4}, std::array{256, 212, 4, 8}}) {
    what.region_width = width;
    what.region_height = height;
    what.region_x = (512 - width) / 2;
    what.region_y = (424 - height) / 2;
    what.samples_per_pixel = samples;
    what.max_surfaces = surfaces;
    const double time = medianOf(3, [&] { light = trace(kinect.scene, what); });
    if (unit == 0.0) unit = time;
    fmt::print("| {} × {} | {} | {} | {:.2f} | {:.2f} |\n", width, height, samples, surfaces, time / unit,
               width * height * samples * surfaces / (256.0 * 212.0 * 4 * 2));
  }
}

double residentMiB() {
  std::ifstream status{"/proc/self/statm"};
  double all = 0.0, resident = 0.0;
  status >> all >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1048576.0;
}

/// Each size in a process of its own, for its memory.
void triangles() {
  fmt::print("\nTriangles of the sphere, median of five frames' light in real time and of direct light alone [ms of processor time]:\n\n"
             "| triangles | real time | direct | resident memory [MiB] |\n| --- | --- | --- | --- |\n");
  std::fflush(stdout);
  for (const int steps : {71, 224, 707, 2236}) {
    if (::fork() == 0) {
      const Files files{steps};
      Kinect kinect{files};
      kinect.trace();
      const double realtime = medianOf(5, [&] { kinect.trace(); });
      kinect.request.max_surfaces = 1;
      const double direct = medianOf(5, [&] { kinect.trace(); });
      fmt::print("| {} | {:.1f} | {:.1f} | {:.0f} |\n", 2 * steps * steps, realtime, direct, residentMiB());
      std::fflush(stdout);
      std::filesystem::remove_all(files.folder());
      ::_exit(0);
    }
    ::wait(nullptr);
  }
}

}  // namespace

int main(int argc, char** argv) {
  daemon::keepFreedMemory();  // as toftwind does
  const std::string_view part = argc > 1 ? argv[1] : "all";
  const auto wants = [&](std::string_view name) { return part == "all" || part == name; };
  // What forks comes first: a child of a process whose threads have started has none of them.
  if (wants("triangles")) triangles();
  const Files files;
  if (wants("frames")) frames(files);
  const tbb::global_control two_threads{tbb::global_control::max_allowed_parallelism, 2};
  if (wants("stages")) stages(files);
  if (wants("errors")) errors(files);
  if (wants("costs")) costs(files);
}
