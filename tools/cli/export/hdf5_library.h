// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include <hdf5.h>
#include <toftwin/result.h>

namespace toftwin::cli {

/// Before anything else of the library: it prints nothing by itself then, and at the end of the program it
/// does not touch files that could not be closed.
void prepareHdf5();

/// What the library's stack of errors says: the innermost line, and the system's number of it, or 0.
struct Hdf5Error {
  std::string text = "no reason given";
  int number = 0;
};
Hdf5Error hdf5Error();

/// The last call's error, with what to do where the system knows.
Error cannotHdf5(const std::filesystem::path& file, const char* doing);

/// Gives a file, group or dataset an attribute. False: see hdf5Error().
bool setText(hid_t of, const std::string& name, const std::string& text);

}  // namespace toftwin::cli
