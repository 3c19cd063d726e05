// SPDX-License-Identifier: Apache-2.0
#include "planted.h"

#include <cmath>
#include <numbers>
#include <random>

#include <Eigen/Dense>
#include <fmt/format.h>

namespace toftwin::discover {
namespace {

constexpr int kRows = 400, kRowsOfACapture = 20;
constexpr double kPeriod = 4.99654;  ///< c/(2 · 30 MHz), in metres

/// Draws that are the same everywhere: the standard fixes the engine, not the distributions.
class Draws {
 public:
  explicit Draws(std::uint64_t seed) : bits_(seed) {}
  double uniform() { return (static_cast<double>(bits_() >> 11) + 0.5) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  double normal() {
    return std::sqrt(-2.0 * std::log(uniform())) * std::cos(2.0 * std::numbers::pi * uniform());
  }
  /// Variance 1: t₄ has 2.
  double t4() {
    double squares = 0.0;
    for (int i = 0; i < 4; ++i) squares += std::pow(normal(), 2);
    return normal() / std::sqrt(squares / 4.0) / std::numbers::sqrt2;
  }

 private:
  std::mt19937_64 bits_;
};

struct Row {
  double time, distance, temperature, ambient, amplitude, exposure, frame, incidence;
};

double valueOf(Hidden hidden, const Row& row) {
  switch (hidden) {
    case Hidden::Nothing:
      return 0.0;
    case Hidden::WarmUp:
      return std::exp(-row.time / 300.0);
    case Hidden::Wiggle:
      return std::cos(2.0 * std::numbers::pi * row.distance / (kPeriod / 4.0) + 0.7);
    case Hidden::Temperature:
      return row.temperature;
    case Hidden::AmbientTimesDistance:
      return row.ambient * row.distance;
    case Hidden::Step:
      return row.time >= 700.0 ? 1.0 : 0.0;
    case Hidden::Parity:
      return std::fmod(row.frame, 2.0);
    case Hidden::InverseAmplitude:
      return 1.0 / row.amplitude;
    case Hidden::Exposure:
      return std::log(row.exposure);
    case Hidden::IncidenceSquared:
      return row.incidence * row.incidence;
    case Hidden::TwoHarmonics: {
      const double phase = 2.0 * std::numbers::pi * row.distance / kPeriod;
      return std::cos(4.0 * phase + 0.7) + 0.6 * std::cos(8.0 * phase - 0.4);
    }
    case Hidden::TanSquared:
      return std::pow(std::tan(row.incidence * std::numbers::pi / 180.0), 2);
    case Hidden::Hinge:
      return std::max(0.0, 150.0 - row.amplitude);
  }
  return 0.0;
}

/// Times √(λ/χ²) of what is left after offset, gain and session offsets.
void scaleTo(double lambda, double sigma, const std::vector<Row>& rows, const std::vector<int>& session,
             Eigen::VectorXd& effect) {
  const int sessions = session.back() + 1;
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(effect.size(), sessions + 1);
  for (Eigen::Index i = 0; i < effect.size(); ++i) {
    x(i, session[static_cast<std::size_t>(i)]) = 1.0;
    x(i, sessions) = rows[static_cast<std::size_t>(i)].distance;
  }
  const Eigen::VectorXd left = effect - x * x.colPivHouseholderQr().solve(effect);
  effect *= std::sqrt(lambda / left.squaredNorm()) * sigma;
}

}  // namespace

const char* nameOf(Hidden hidden) {
  switch (hidden) {
    case Hidden::Nothing:
      return "nothing";
    case Hidden::WarmUp:
      return "exp(-time/300 s)";
    case Hidden::Wiggle:
      return "4 waves per period";
    case Hidden::Temperature:
      return "temperature";
    case Hidden::AmbientTimesDistance:
      return "ambient x distance";
    case Hidden::Step:
      return "step at 700 s";
    case Hidden::Parity:
      return "odd frames";
    case Hidden::InverseAmplitude:
      return "1/amplitude";
    case Hidden::Exposure:
      return "ln exposure";
    case Hidden::TwoHarmonics:
      return "4 and 8 waves per period";
    case Hidden::TanSquared:
      return "tan^2 of incidence";
    case Hidden::Hinge:
      return "below amplitude 150";
    case Hidden::IncidenceSquared:
      break;
  }
  return "incidence^2";
}

std::vector<std::string> covariatesOf(Hidden hidden) {
  switch (hidden) {
    case Hidden::WarmUp:
    case Hidden::Step:
      return {"time_s"};
    case Hidden::Wiggle:
    case Hidden::TwoHarmonics:
      return {"distance_m"};
    case Hidden::Temperature:
      return {"temperature_c"};
    case Hidden::AmbientTimesDistance:
      return {"ambient_klx", "distance_m"};
    case Hidden::Parity:
      return {"frame"};
    case Hidden::InverseAmplitude:
    case Hidden::Hinge:
      return {"amplitude"};
    case Hidden::Exposure:
      return {"exposure_us"};
    case Hidden::IncidenceSquared:
    case Hidden::TanSquared:
      return {"incidence_deg"};
    case Hidden::Nothing:
      break;
  }
  return {};
}

Planted plant(std::uint64_t seed, const std::vector<Hidden>& hidden, double lambda, const Errors& errors) {
  Draws draws{seed * 2654435761U + 12345U};
  std::vector<Row> rows;
  Planted out;
  TableData& data = out.data;
  const int count = errors.captures > 0 ? errors.captures * kRowsOfACapture : kRows;
  const double exposures[]{200.0, 500.0, 1000.0, 2000.0};
  std::vector<double> room, offset;
  for (int s = 0; s < errors.sessions; ++s)
    room.push_back(draws.uniform(15.0, 30.0)), offset.push_back(errors.session_mm * draws.normal());
  double capture_distance = 0.0, capture_offset = 0.0;
  std::vector<double> own_offset(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    const int session = i * errors.sessions / count;
    Row row{};
    row.time = 15.0 * (i % (count / errors.sessions)) + draws.uniform(0.0, 10.0);
    row.distance = draws.uniform(0.5, 4.0);
    row.temperature =
        room[static_cast<std::size_t>(session)] + 12.0 * (1.0 - std::exp(-row.time / 400.0)) + draws.normal();
    row.ambient = draws.uniform(0.0, 40.0);
    row.exposure = exposures[static_cast<int>(4.0 * draws.uniform())];
    row.amplitude = row.exposure * draws.uniform(0.1, 0.9) / (row.distance * row.distance);
    row.frame = 37.0 * i + std::floor(draws.uniform(0.0, 20.0));
    row.incidence = draws.uniform(0.0, 60.0);
    if (errors.logged_mm > 0.0 && i % kRowsOfACapture != 0) row.ambient = rows.back().ambient;
    if (errors.captures > 0) {
      if (i % kRowsOfACapture == 0) {
        capture_distance = row.distance, capture_offset = errors.capture_mm * draws.normal();
      } else {
        row.temperature = rows.back().temperature, row.ambient = rows.back().ambient;
      }
      row.distance = capture_distance + draws.uniform(-0.25, 0.25);
      own_offset[static_cast<std::size_t>(i)] = capture_offset;
      data.capture.push_back(i / kRowsOfACapture);
    }
    rows.push_back(row);
    data.session.push_back(session);
  }
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(count);
  for (const Hidden one : hidden) {
    if (one == Hidden::Nothing) continue;
    Eigen::VectorXd effect(count);
    for (int i = 0; i < count; ++i) effect(i) = valueOf(one, rows[static_cast<std::size_t>(i)]);
    scaleTo(lambda, errors.sigma_mm, rows, data.session, effect);
    sum += effect;
  }
  double logged = 0.0, walk = 0.0;
  for (int i = 0; i < count; ++i) {
    const Row& row = rows[static_cast<std::size_t>(i)];
    if (errors.logged_mm > 0.0 && i % kRowsOfACapture == 0) logged = errors.logged_mm * draws.normal();
    if (errors.ar1_mm > 0.0) walk = 0.9 * walk + std::sqrt(0.19) * errors.ar1_mm * draws.normal();
    double noise = errors.sigma_mm * (errors.heavy_tails ? draws.t4() : draws.normal());
    if (errors.bumped && i >= 120 && i < 130) noise += 6.0 * errors.sigma_mm;
    data.error.push_back(3.0 + 2.0 * row.distance + offset[data.session[static_cast<std::size_t>(i)]] +
                         own_offset[static_cast<std::size_t>(i)] + sum(i) + noise + logged + walk);
    data.reference.push_back(row.distance);
    data.line.push_back(static_cast<std::size_t>(i) + 2);
  }
  out.effect_mm.assign(sum.begin(), sum.end());
  const auto column = [&](const char* name, Nature nature, double Row::*member) {
    TableCovariate covariate{name, nature, {}, {}};
    for (const Row& row : rows) covariate.values.push_back(row.*member);
    data.covariates.push_back(std::move(covariate));
  };
  column("distance_m", Nature::Distance, &Row::distance);
  column("time_s", Nature::Time, &Row::time);
  column("temperature_c", Nature::Plain, &Row::temperature);
  column("ambient_klx", Nature::Plain, &Row::ambient);
  column("exposure_us", Nature::Plain, &Row::exposure);
  column("amplitude", Nature::Plain, &Row::amplitude);
  column("frame", Nature::Index, &Row::frame);
  column("incidence_deg", Nature::Angle, &Row::incidence);
  data.reference_name = "distance_m", data.unit = "mm", data.period = kPeriod;
  for (int s = 1; s <= errors.sessions; ++s) data.session_names.push_back(std::to_string(s));
  data.locked.assign(static_cast<std::size_t>(count), false);
  return out;
}

std::string csvOf(const TableData& data, bool has_day) {
  std::string text = has_day ? "error_mm,session,day" : "error_mm,session";
  for (const TableCovariate& covariate : data.covariates) text += "," + covariate.name;
  for (std::size_t i = 0; i < data.rows(); ++i) {
    text += fmt::format("\n{},{}", data.error[i], data.session[i]);
    if (has_day) text += fmt::format(",{}", 3 * data.session[i] + 1);
    for (const TableCovariate& covariate : data.covariates) text += fmt::format(",{}", covariate.values[i]);
  }
  return text + "\n";
}

}  // namespace toftwin::discover
