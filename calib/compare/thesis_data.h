// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

namespace toftwin::compare {

/// The folder `tof-thesis-2018` of real measurements: in (or as) `given` if that is not empty, else
/// in $TOFTWIN_DATA, else in `../shared/data` of the repository that holds the working folder or
/// this program. Nothing if there is none.
std::optional<std::filesystem::path> findThesisData(const std::filesystem::path& given = {});

}  // namespace toftwin::compare
