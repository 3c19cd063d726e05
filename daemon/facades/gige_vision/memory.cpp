// SPDX-License-Identifier: Apache-2.0
#include "daemon/facades/gige_vision/memory.h"

#include <algorithm>
#include <string>

namespace toftwin::daemon::gige_vision {
namespace {

std::uint64_t endOfFeatures() {
  std::uint64_t end = kFirstFeature;
  for (const Row& row : allRows())
    end = std::max<std::uint64_t>(end, row.address + std::uint64_t{row.bytes()});
  return end;
}

/// Where what stands beside a row begins: bounds, whether it is there, whether it is locked.
std::uint32_t boundsAt(const Row& row) { return row.address + row.size * row.count(); }
std::uint32_t availableAt(const Row& row) {
  return boundsAt(row) + ((row.beside & Beside::kBounds) != 0 ? 2 * row.size : 0);
}

}  // namespace

Memory::Memory() : bytes_(kBootstrapEnd + (endOfFeatures() - kFirstFeature)) {
  for (const Row& row : allRows()) {
    if ((row.beside & Beside::kAvailable) != 0) setAvailable(row.item, false);
  }
}

std::size_t Memory::offsetOf(std::uint32_t address) const {
  return address < kFirstFeature ? address : kBootstrapEnd + (address - kFirstFeature);
}

void Memory::put(std::uint32_t address, std::uint64_t value, std::uint32_t size) {
  Bytes bytes;
  append(bytes, value, size);
  std::ranges::copy(bytes, bytes_.begin() + static_cast<std::ptrdiff_t>(offsetOf(address)));
}
std::uint64_t Memory::get(std::uint32_t address, std::uint32_t size) const {
  return numberAt(bytes_, offsetOf(address), size);
}

void Memory::setNumber(Item item, std::uint64_t value, std::uint32_t index) {
  const Row& row = rowOf(item);
  put(row.address + index * row.size, value, row.size);
}

void Memory::setText(Item item, std::string_view text) {
  const Row& row = rowOf(item);
  std::string whole{text.substr(0, row.size - 1)};
  whole.resize(row.size, '\0');
  for (std::uint32_t i = 0; i < row.size; ++i) put(row.address + i, static_cast<unsigned char>(whole[i]), 1);
}

void Memory::setBounds(Item item, double least, double most) {
  const Row& row = rowOf(item);
  put(boundsAt(row), std::bit_cast<std::uint64_t>(least), 8);
  put(boundsAt(row) + 8, std::bit_cast<std::uint64_t>(most), 8);
}
void Memory::setAvailable(Item item, bool is_available) {
  put(availableAt(rowOf(item)), is_available ? 1 : 0, 4);
}
void Memory::setLocked(Item item, bool is_locked) { put(availableAt(rowOf(item)) + 4, is_locked ? 1 : 0, 4); }

std::uint64_t Memory::number(Item item, std::uint32_t index) const {
  const Row& row = rowOf(item);
  return get(row.address + index * row.size, row.size);
}
bool Memory::isLocked(Item item) const {
  const Row& row = rowOf(item);
  return (row.beside & Beside::kLocked) != 0 && get(availableAt(row) + 4, 4) != 0;
}
double Memory::least(Item item) const { return std::bit_cast<double>(get(boundsAt(rowOf(item)), 8)); }
double Memory::most(Item item) const { return std::bit_cast<double>(get(boundsAt(rowOf(item)) + 8, 8)); }

bool Memory::read(std::uint64_t address, std::size_t size, Bytes& to) const {
  const std::uint64_t end = address + size;  // 32 bits would overflow
  const std::string& xml = genicamXml();
  if (address >= kXmlAddress && address - kXmlAddress < xml.size()) {
    constexpr std::uint64_t kWord = 4;
    const std::uint64_t xml_end = kXmlAddress + (xml.size() + kWord - 1) / kWord * kWord;
    if (end > xml_end) return false;
    for (std::uint64_t at = address - kXmlAddress; at < end - kXmlAddress; ++at)
      to.push_back(at < xml.size() ? static_cast<std::byte>(xml[at]) : std::byte{0});
    return true;
  }
  const bool is_bootstrap = end <= kBootstrapEnd;
  const bool is_feature = address >= kFirstFeature && end - kFirstFeature <= bytes_.size() - kBootstrapEnd;
  if (!is_bootstrap && !is_feature) return false;
  const auto begin =
      bytes_.begin() + static_cast<std::ptrdiff_t>(offsetOf(static_cast<std::uint32_t>(address)));
  to.insert(to.end(), begin, begin + static_cast<std::ptrdiff_t>(size));
  return true;
}

std::optional<Memory::Element> Memory::elementAt(std::uint64_t address) {
  for (const Row& row : allRows()) {
    const std::uint64_t end = row.address + std::uint64_t{row.size} * row.count();
    if (address < row.address || address >= end) continue;
    const auto index = static_cast<std::uint32_t>((address - row.address) / row.size);
    return Element{&row, index, row.address + index * row.size};
  }
  return std::nullopt;
}

std::span<const std::byte> Memory::bytes(const Element& element) const {
  return std::span{bytes_}.subspan(offsetOf(element.address), element.row->size);
}
void Memory::setBytes(const Element& element, std::span<const std::byte> bytes) {
  std::ranges::copy(bytes, bytes_.begin() + static_cast<std::ptrdiff_t>(offsetOf(element.address)));
}

}  // namespace toftwin::daemon::gige_vision
