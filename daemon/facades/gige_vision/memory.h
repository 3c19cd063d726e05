// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "daemon/facades/gige_vision/features.h"
#include "daemon/facades/gige_vision/gvcp.h"

namespace toftwin::daemon::gige_vision {

/// The camera's memory: registers as numbers on one side, big endian bytes on the other.
class Memory {
 public:
  Memory();

  void setNumber(Item item, std::uint64_t value, std::uint32_t index = 0);
  void setFloat(Item item, double value, std::uint32_t index = 0) {
    setNumber(item, std::bit_cast<std::uint64_t>(value), index);
  }
  /// Cut, so that a zero follows.
  void setText(Item item, std::string_view text);
  /// What stands beside it, as far as its row has it.
  void setBounds(Item item, double least, double most);
  void setAvailable(Item item, bool is_available);
  void setLocked(Item item, bool is_locked);

  [[nodiscard]] std::uint64_t number(Item item, std::uint32_t index = 0) const;
  [[nodiscard]] double real(Item item) const { return std::bit_cast<double>(number(item)); }
  [[nodiscard]] bool isLocked(Item item) const;
  [[nodiscard]] double least(Item item) const;
  [[nodiscard]] double most(Item item) const;

  /// Appends bytes; whether there are so many at that address. Places without a register read as zero.
  bool read(std::uint64_t address, std::size_t size, Bytes& to) const;

  /// One register, or one of a selector's, that an address belongs to.
  struct Element {
    const Row* row = nullptr;
    std::uint32_t index = 0, address = 0;
  };
  static std::optional<Element> elementAt(std::uint64_t address);
  [[nodiscard]] std::span<const std::byte> bytes(const Element& element) const;
  void setBytes(const Element& element, std::span<const std::byte> bytes);

 private:
  [[nodiscard]] std::size_t offsetOf(std::uint32_t address) const;
  void put(std::uint32_t address, std::uint64_t value, std::uint32_t size);
  [[nodiscard]] std::uint64_t get(std::uint32_t address, std::uint32_t size) const;

  Bytes bytes_;  ///< bootstrap registers, then features
};

}  // namespace toftwin::daemon::gige_vision
