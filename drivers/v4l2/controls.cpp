// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/controls.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

namespace toftwin::drivers::v4l2 {
namespace {

constexpr int kMostControls = 512;
constexpr std::int64_t kLongestMenu = 256;
constexpr std::uint32_t kDriversOwn = 0x1000;  // numbers from here on within a class

/// Names end in their unit where V4L2 says what it is.
struct Known {
  std::uint32_t id;
  const char* name;
  std::int64_t unit;
};
constexpr std::array kKnown{
    Known{V4L2_CID_EXPOSURE_ABSOLUTE, "exposure_us", 100},
    Known{V4L2_CID_WHITE_BALANCE_TEMPERATURE, "white_balance_k", 1},
};

/// "Exposure Time, Absolute" → "exposure_time_absolute".
std::string parameterName(const char* kernel_name, std::size_t most) {
  std::string name;
  for (std::size_t i = 0; i < most && kernel_name[i] != '\0'; ++i) {
    const auto c = static_cast<unsigned char>(kernel_name[i]);
    if (std::isalnum(c) != 0) {
      name += static_cast<char>(std::tolower(c));
    } else if (!name.empty() && name.back() != '_') {
      name += '_';
    }
  }
  while (!name.empty() && name.back() == '_') name.pop_back();
  return name;
}

bool isParameter(const v4l2_queryctrl& control) {
  switch (V4L2_CTRL_ID2CLASS(control.id)) {
    case V4L2_CTRL_CLASS_USER:
    case V4L2_CTRL_CLASS_CAMERA:
    case V4L2_CTRL_CLASS_IMAGE_SOURCE:
    case V4L2_CTRL_CLASS_IMAGE_PROC:
      break;
    default:
      return false;
  }
  constexpr std::uint32_t kUnusable =
      V4L2_CTRL_FLAG_DISABLED | V4L2_CTRL_FLAG_READ_ONLY | V4L2_CTRL_FLAG_WRITE_ONLY;
  const bool is_number =
      control.type == V4L2_CTRL_TYPE_INTEGER || control.type == V4L2_CTRL_TYPE_BOOLEAN ||
      control.type == V4L2_CTRL_TYPE_MENU || control.type == V4L2_CTRL_TYPE_INTEGER_MENU;
  return is_number && (control.flags & kUnusable) == 0 &&
         (control.id & 0xFFFFU) < 0x900U + kDriversOwn;
}

std::vector<std::int64_t> menuOf(const Device& device, const v4l2_queryctrl& control) {
  std::vector<std::int64_t> choices;
  const std::int64_t last = std::min<std::int64_t>(control.maximum, kLongestMenu);
  for (std::int64_t i = std::max(0, control.minimum); i <= last; ++i) {
    v4l2_querymenu choice{};
    choice.id = control.id;
    choice.index = static_cast<std::uint32_t>(i);
    if (device.control(VIDIOC_QUERYMENU, &choice) == 0) choices.push_back(i);
  }
  return choices;
}

}  // namespace

std::vector<Control> controlsOf(const Device& device) {
  std::vector<Control> controls;
  v4l2_queryctrl one{};
  one.id = V4L2_CTRL_FLAG_NEXT_CTRL;
  for (int i = 0; i < kMostControls && device.control(VIDIOC_QUERYCTRL, &one) == 0; ++i) {
    const std::uint32_t id = one.id;
    if (isParameter(one)) {
      Control control{
          .id = id,
          .name = parameterName(reinterpret_cast<const char*>(one.name), sizeof one.name),
          .min = one.minimum,
          .max = one.maximum,
          .step = std::max<std::int64_t>(1, one.step)};
      control.is_menu = one.type == V4L2_CTRL_TYPE_MENU || one.type == V4L2_CTRL_TYPE_INTEGER_MENU;
      if (control.is_menu) control.menu = menuOf(device, one);
      const auto known = std::ranges::find(kKnown, id, &Known::id);
      if (known != kKnown.end()) {
        control.name = known->name;
        control.unit = known->unit;
      }
      const bool is_new =
          std::ranges::find(controls, control.name, &Control::name) == controls.end();
      const bool has_values = control.is_menu ? !control.menu.empty() : control.min <= control.max;
      if (is_new && has_values && !control.name.empty()) {
        controls.push_back(std::move(control));
      }
    }
    one = {};
    one.id = id | V4L2_CTRL_FLAG_NEXT_CTRL;
  }
  return controls;
}

Parameter stateOf(const Device& device, const Control& control) {
  Parameter state{.name = control.name};
  v4l2_queryctrl now{};
  now.id = control.id;
  v4l2_control value{};
  value.id = control.id;
  const bool is_steady =
      device.control(VIDIOC_QUERYCTRL, &now) == 0 &&
      (now.flags & (V4L2_CTRL_FLAG_INACTIVE | V4L2_CTRL_FLAG_VOLATILE | V4L2_CTRL_FLAG_GRABBED)) ==
          0;
  if (is_steady && device.control(VIDIOC_G_CTRL, &value) == 0) {
    state.value = static_cast<double>(value.value * control.unit);
  }
  const std::int64_t first = control.menu.empty() ? control.min : control.menu.front();
  const std::int64_t last = control.menu.empty() ? control.max : control.menu.back();
  state.bounds = {static_cast<double>(first * control.unit),
                  static_cast<double>(last * control.unit)};
  return state;
}

Result<> set(const Device& device, const Control& control, double value) {
  const auto refuse = [&](std::string_view why) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{} = {}: {}", control.name, value, why)};
  };
  const double code = value / static_cast<double>(control.unit);
  const auto min = static_cast<double>(control.min), max = static_cast<double>(control.max);
  const auto unit = control.unit;
  if (!(code >= min && code <= max)) {
    return refuse(fmt::format("it must be from {} to {}", control.min * unit, control.max * unit));
  }
  const std::int64_t whole = std::llround(code);
  if (static_cast<double>(whole) != code || (whole - control.min) % control.step != 0) {
    return refuse(fmt::format("it goes from {} to {} in steps of {}", control.min * unit,
                              control.max * unit, control.step * unit));
  }
  if (control.is_menu && std::ranges::find(control.menu, whole) == control.menu.end()) {
    return refuse(fmt::format("it must be one of {}", fmt::join(control.menu, ", ")));
  }
  v4l2_control wish{};
  wish.id = control.id;
  wish.value = static_cast<std::int32_t>(whole);
  if (const int error = device.control(VIDIOC_S_CTRL, &wish); error != 0) {
    Error said =
        failure(device.node(), fmt::format("does not take {} = {}", control.name, value), error);
    if (said.code == Error::Code::PermissionDenied || said.code == Error::Code::Busy) {
      said = {
          Error::Code::Unsupported,
          fmt::format("v4l2: {} takes no {} at present; if it is set automatically, turn that off "
                      "first",
                      device.node(), control.name)};
    }
    if (said.code == Error::Code::Incompatible) said.code = Error::Code::InvalidArgument;
    return said;
  }
  return {};
}

}  // namespace toftwin::drivers::v4l2
