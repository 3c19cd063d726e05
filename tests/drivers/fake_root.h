// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "../open_folder.h"

namespace toftwin::test {

/// A folder that stands for "/" and is gone afterwards.
class FakeRoot {
 public:
  FakeRoot() : path_(makeOpenFolder("root")) {}
  ~FakeRoot() { std::filesystem::remove_all(path_); }
  FakeRoot(const FakeRoot&) = delete;
  FakeRoot& operator=(const FakeRoot&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  void write(const std::string& file, const std::string& text) const {
    std::filesystem::create_directories((path_ / file).parent_path());
    std::ofstream{path_ / file} << text << '\n';
  }
  /// A USB device, plugged in at that port, with its node.
  void plugIn(const std::string& port, const std::string& vendor, const std::string& product,
              const std::string& mbit_s) const {
    const std::string folder = "sys/bus/usb/devices/" + port + "/";
    write(folder + "idVendor", vendor);
    write(folder + "idProduct", product);
    write(folder + "speed", mbit_s);
    write(folder + "serial", "A0" + port);
    write(folder + "busnum", "2");
    write(folder + "devnum", "5");
    write("dev/bus/usb/002/005", "");
  }

 private:
  std::filesystem::path path_;
};

}  // namespace toftwin::test
