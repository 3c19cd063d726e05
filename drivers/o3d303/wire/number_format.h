// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <boost/property_tree/ptree_fwd.hpp>

#include <toftwin/result.h>

#include "drivers/o3d303/wire/bytes.h"

/// How a number of a frame is written: the property "format" of a schema and of its elements.
namespace toftwin::o3d303 {

enum class NumberType { UInt8, Int8, UInt16, Int16, UInt32, Int32, Float32 };

/// What is written is scale · number + offset, rounded where the type is an integer.
struct NumberFormat {
  enum class Encoding { Ascii, Binary };
  enum class Order { Little, Big };
  Encoding encoding = Encoding::Ascii;
  Order order = Order::Little;  ///< "network" is Big
  double scale = 1.0, offset = 0.0;
  // Of ASCII alone. A longer number is not cut to the width.
  int width = 0, precision = 6, base = 10;
  char fill = ' ', decimal_separator = '.';
  bool is_scientific = false, is_left_aligned = false;

  bool operator==(const NumberFormat&) const = default;
};

/// The format with what the property says on top of it. Unsupported: a property or a value that this camera
/// does not have.
Result<NumberFormat> formatWith(NumberFormat format, const boost::property_tree::ptree& property);

/// What does not fit into an integer is the nearest that does; what is no number is 0.
void appendFormatted(Bytes& bytes, double number, NumberType type, const NumberFormat& format);

}  // namespace toftwin::o3d303
