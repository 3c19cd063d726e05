// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// Finding GigE Vision cameras, and asking one whether it lives. libaravis can do the former, but
/// takes a second or three for it; a lost camera is to be back within one.
namespace toftwin::drivers::aravis {

struct GigeCamera {
  std::uint32_t address = 0;  ///< where it answered from; the first byte is the highest
  std::string vendor, model, serial, user_name, mac;

  /// As libaravis' tools name it: vendor-model-serial.
  [[nodiscard]] std::string name() const;
  /// Whether a user means this one: by address, serial number, either name or MAC address.
  [[nodiscard]] bool isCalled(std::string_view name) const;
};

/// "192.168.0.20" ⇄ 0xC0A80014.
std::optional<std::uint32_t> addressOf(const std::string& text);
std::string textOf(std::uint32_t address);

/// What a camera said in answer to a discovery of that number, or nothing if these bytes are none.
std::optional<GigeCamera> readDiscoveryAnswer(std::span<const std::byte> datagram,
                                              std::uint16_t request);

/// Asks on every network interface. Ends early when `enough` says so of a camera that answered.
struct Discovery {
  std::chrono::milliseconds wait{400};
  bool on_this_host = false;  ///< also cameras that programs on this computer pretend to be
  std::function<bool(const GigeCamera&)> enough{};
};
std::vector<GigeCamera> discover(const Discovery& how);
/// Whether this process may see its network interfaces, without which it can ask nobody.
bool seesInterfaces();
/// Asks one, twice if it does not answer at once.
std::optional<GigeCamera> discoverAt(std::uint32_t address, std::chrono::milliseconds wait);

/// A bootstrap register of the camera, for which one need not control it; likewise.
std::optional<std::uint32_t> readRegister(std::uint32_t camera, std::uint32_t address,
                                          std::chrono::milliseconds wait);
inline constexpr std::uint32_t kControlPrivilege = 0x0A00;  ///< 0: nobody controls the camera

/// The address of the interface from which packets go to that camera.
std::optional<std::uint32_t> interfaceTowards(std::uint32_t camera);

}  // namespace toftwin::drivers::aravis
