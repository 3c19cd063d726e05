// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/system.h"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <utility>

namespace toftwin::drivers::v4l2 {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = "video";

template <class Call>
int untilDone(Call call) {
  while (true) {
    const int result = call();
    if (result >= 0) return result;
    if (errno != EINTR) return -errno;
  }
}

class Kernel final : public System {
 public:
  std::vector<std::string> nodes() override {
    std::vector<std::pair<int, std::string>> found;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator{"/dev", error}) {
      const std::string name = entry.path().filename().string();
      if (!name.starts_with(kPrefix)) continue;
      int number = 0;
      const char* end = name.data() + name.size();
      const auto read = std::from_chars(name.data() + kPrefix.size(), end, number);
      if (read.ec == std::errc{} && read.ptr == end) found.emplace_back(number, entry.path());
    }
    std::ranges::sort(found);
    std::vector<std::string> names;
    for (auto& [number, name] : found) names.push_back(std::move(name));
    return names;
  }

  std::string usbAttribute(const std::string& node, std::string_view name) override {
    // The node's device is a USB interface; the attributes are those of the folder above.
    const fs::path interface =
        fs::path{"/sys/class/video4linux"} / fs::path{node}.filename() / "device";
    std::error_code error;
    const fs::path device = fs::canonical(interface, error);
    std::string value;
    if (!error) std::getline(std::ifstream{device.parent_path() / name}, value);
    return value;
  }

  int open(const std::string& node) override {
    return untilDone([&] { return ::open(node.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC); });
  }
  void close(int file) override { ::close(file); }
  int ioctl(int file, unsigned long request, void* argument) override {
    return untilDone([&] { return ::ioctl(file, request, argument); });
  }
  int poll(std::span<pollfd> files, int timeout_ms) override {
    return untilDone([&] { return ::poll(files.data(), files.size(), timeout_ms); });
  }

  std::span<std::byte> map(int file, std::size_t length, std::int64_t offset) override {
    void* bytes = ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, file, offset);
    if (bytes == MAP_FAILED) return {};
    return {static_cast<std::byte*>(bytes), length};
  }
  void unmap(std::span<std::byte> bytes) override { ::munmap(bytes.data(), bytes.size()); }
};

}  // namespace

System& kernel() {
  static Kernel the_kernel;  // without state
  return the_kernel;
}

}  // namespace toftwin::drivers::v4l2
