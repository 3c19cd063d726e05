// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <toftwin/parameter.h>

/// Which of the source's parameters the camera's are.
namespace toftwin::daemon::o3d303 {

struct Binding {
  enum class Object { Imager, SpatialFilter, TemporalFilter };
  enum class Form { Whole, Real, Switch };
  Object object = Object::Imager;
  std::string_view name, source_name;
  Form form = Form::Whole;
  /// The source's number is offset + scale times the camera's.
  double offset = 0.0;
  bool is_electrons = false;  ///< scale: the facade's electrons_per_count; else 1
};
std::span<const Binding> bindings();

/// A binding to a source that has the parameter.
struct Bound {
  const Binding* binding;
  const Parameter* parameter;  ///< of the source
  double scale;

  [[nodiscard]] double toSource(double camera) const { return binding->offset + scale * camera; }
  [[nodiscard]] double fromSource(double source) const { return (source - binding->offset) / scale; }
  /// As the camera writes it.
  [[nodiscard]] std::string text(double source) const;
  /// Of the camera's number.
  [[nodiscard]] Bounds bounds() const;
};

/// The parameter of the application: 1 free run is 0, 2 by command is 1.
inline constexpr std::string_view kTriggered = "triggered";
/// Of the imager's type: how many.
inline constexpr std::string_view kFrequencies = "frequencies", kExposures = "exposures";

/// "upto30m_moderate" has two frequencies and two exposures.
struct ImagerType {
  int frequencies = 1, exposures = 1;
  [[nodiscard]] std::string text() const;
  static std::optional<ImagerType> of(std::string_view text);
  bool operator==(const ImagerType&) const = default;
};

}  // namespace toftwin::daemon::o3d303
