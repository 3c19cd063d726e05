// SPDX-License-Identifier: Apache-2.0
// Which values of the tree are those of a port's source.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>

#include "daemon/facades/o3r/parameters.h"

namespace toftwin::daemon::o3r {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

/// A value below a port that is a parameter of the source: source = scale · value.
struct Binding {
  std::string_view place;
  std::string_view parameter;
  enum class Form { Real, Whole, Switch } form = Form::Real;
  double when_on = 1.0;       ///< of a switch
  bool is_per_count = false;  ///< the scale is electrons_per_count
};
// Where a source has several of a place, the first counts.
constexpr std::array kBindings{
    Binding{"/acquisition/exposureLong", "exposure_us", Binding::Form::Whole},
    Binding{"/acquisition/framerate", "frame_rate_hz"},
    Binding{"/processing/diParam/minAmplitude", "minimum_amplitude"},
    Binding{"/processing/diParam/minAmplitude", "minimum_amplitude_electrons", Binding::Form::Real, 1.0,
            true},
    Binding{"/processing/diParam/maxSymmetry", "asymmetry_threshold"},
    Binding{"/processing/diParam/enableTemporalFilter", "temporal_filter", Binding::Form::Switch, 2.0},
};
constexpr std::string_view kShort = "/acquisition/exposureShort", kLong = "/acquisition/exposureLong",
                           kMedian = "/processing/diParam/medianSizeDiv2";

const Parameter* find(const PortFacts& facts, std::string_view name) {
  const auto found = std::ranges::find(facts.parameters, name, &Parameter::name);
  return found != facts.parameters.end() && found->value ? &*found : nullptr;
}

/// The first binding of that place that the source has.
const Binding* bindingOf(std::string_view place, const PortFacts& facts) {
  const auto found = std::ranges::find_if(kBindings, [&](const Binding& one) {
    return one.place == place && find(facts, one.parameter) != nullptr;
  });
  return found != kBindings.end() ? &*found : nullptr;
}

double scaleOf(const Binding& binding, double electrons_per_count) {
  return binding.is_per_count ? electrons_per_count : 1.0;
}

Json shownValue(const Binding& binding, double source, double scale) {
  switch (binding.form) {
    case Binding::Form::Switch:
      return source != 0.0;
    case Binding::Form::Whole:
      return static_cast<std::int64_t>(std::llround(source / scale));
    case Binding::Form::Real:
      break;
  }
  return source / scale;
}

void show(Leaf& leaf, Json value, bool is_first) {
  leaf.is_read_only = false;
  if (is_first) leaf.factory = value;
  leaf.value = std::move(value);
}

/// What the device takes and the source, together.
void narrow(Leaf& leaf, double least, double most) {
  Json& schema = leaf.schema = leaf.widest;
  const double lowest = schema.value("minimum", -HUGE_VAL), highest = schema.value("maximum", HUGE_VAL);
  const bool is_whole = schema.at("type") == "integer";
  const double from = std::max(lowest, is_whole ? std::ceil(least) : least);
  const double to = std::min(highest, is_whole ? std::floor(most) : most);
  if (from > to) return;
  schema["minimum"] = from;
  schema["maximum"] = to;
}

void showBound(Leaf& leaf, const Binding* binding, const PortFacts& facts, double electrons_per_count,
               bool is_first) {
  if (binding == nullptr) {
    leaf.is_read_only = true;  // the source has nothing of the kind
    return;
  }
  const Parameter& parameter = *find(facts, binding->parameter);
  const double scale = scaleOf(*binding, electrons_per_count);
  show(leaf, shownValue(*binding, *parameter.value, scale), is_first);
  if (binding->form != Binding::Form::Switch)
    narrow(leaf, parameter.bounds.min / scale, parameter.bounds.max / scale);
}

void showShortExposure(Leaf& leaf, const PortFacts& facts, bool is_first) {
  const Parameter *exposure = find(facts, "exposure_us"), *ratio = find(facts, "exposure_ratio");
  leaf.is_read_only = exposure == nullptr || ratio == nullptr;
  if (!leaf.is_read_only)
    show(leaf, static_cast<std::int64_t>(std::llround(*exposure->value / *ratio->value)), is_first);
}

void showMedian(Leaf& leaf, const PortFacts& facts, bool is_first) {
  const Parameter *filter = find(facts, "spatial_filter"), *reach = find(facts, "spatial_filter_reach");
  leaf.is_read_only = filter == nullptr || reach == nullptr;
  if (!leaf.is_read_only)
    show(leaf,
         *filter->value == 1.0 ? static_cast<std::int64_t>(std::llround(*reach->value)) : std::int64_t{0},
         is_first);
}

void showCamera(Configuration& configuration, const std::string& port, const CameraInfo& camera) {
  if (camera.width <= 0 || camera.fx <= 0.0 || camera.fy <= 0.0) return;
  const auto angle = [](int pixels, double focal) {
    return std::round(2.0 * kDegrees * std::atan(pixels / (2.0 * focal)));
  };
  const std::string at = port + "/info/features/";
  configuration.at(at + "fov/horizontal").value = angle(camera.width, camera.fx);
  configuration.at(at + "fov/vertical").value = angle(camera.height, camera.fy);
  configuration.at(at + "resolution/width").value = camera.width;
  configuration.at(at + "resolution/height").value = camera.height;
}

}  // namespace

void showSource(Configuration& configuration, const PortIdentity& port, const PortFacts& facts,
                double electrons_per_count, bool is_first) {
  const std::string at = portPointer(port.number);
  showCamera(configuration, at, facts.camera);
  for (const Binding& one : kBindings) {
    const std::string place = at + std::string{one.place};
    if (!configuration.leaves().contains(place)) continue;  // of a 2D head
    showBound(configuration.at(place), bindingOf(one.place, facts), facts, electrons_per_count, is_first);
  }
  if (!port.is_3d) return;
  showShortExposure(configuration.at(at + std::string{kShort}), facts, is_first);
  showMedian(configuration.at(at + std::string{kMedian}), facts, is_first);
}

Result<SourceChanges> sourceChangesOf(const Configuration& configuration,
                                      const Configuration::Changes& changes, const PortIdentity& port,
                                      const PortFacts& facts, double electrons_per_count) {
  const std::string at = portPointer(port.number);
  const auto changed = [&](std::string_view place) -> const Json* {
    const auto found =
        std::ranges::find(changes, at + std::string{place}, &Configuration::Changes::value_type::first);
    return found != changes.end() ? &found->second : nullptr;
  };
  SourceChanges wanted;
  for (const Binding& one : kBindings) {
    const Json* value = changed(one.place);
    if (value == nullptr || bindingOf(one.place, facts) != &one) continue;
    const double number = one.form == Binding::Form::Switch
                              ? (value->get<bool>() ? one.when_on : 0.0)
                              : value->get<double>() * scaleOf(one, electrons_per_count);
    wanted.emplace_back(one.parameter, number);
  }
  // The source has a ratio where the head has two times: either of them changes it.
  const Json *longer = changed(kLong), *shorter = changed(kShort);
  if (shorter != nullptr) {
    const double long_us = longer != nullptr ? longer->get<double>()
                                             : configuration.valueAt(at + std::string{kLong}).get<double>();
    const Parameter* ratio = find(facts, "exposure_ratio");
    const double asked = long_us / shorter->get<double>();
    if (ratio == nullptr || !ratio->bounds.contains(asked)) {
      return Error{Error::Code::InvalidArgument,
                   "exposureShort: the source does not take that share of exposureLong; ask for another"};
    }
    wanted.emplace_back("exposure_ratio", asked);
  }
  if (const Json* median = changed(kMedian)) {
    const auto size = median->get<double>();
    wanted.emplace_back("spatial_filter", size > 0.0 ? 1.0 : 0.0);
    if (size > 0.0) wanted.emplace_back("spatial_filter_reach", size);
  }
  return wanted;
}

}  // namespace toftwin::daemon::o3r
