// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <toftwin/result.h>

#include "sim/sensor/sensor_model.h"
#include "tools/validate/description.h"

namespace toftwin::validate {

/// A camera that the data are of, and what simulates it.
struct Subject {
  std::string name, title;
  sim::SensorModel model;
};

/// A dataset file, read and checked.
struct Dataset {
  std::string title, other = "other simulator";
  std::vector<std::string> notes;
  std::filesystem::path file;    ///< the description
  std::filesystem::path folder;  ///< the data
  std::vector<Subject> cameras;
  std::vector<Judgement> judgements;

  [[nodiscard]] const Subject& camera(const std::string& name) const;
};

/// Reads a description. `data`: a folder that is the data's, or holds it; empty: see findData(). Errors name file,
/// line and key; a camera, a scene or an effect that is not known is one. NotFound: the data's folder is nowhere.
Result<Dataset> loadDataset(const std::filesystem::path& file, const std::filesystem::path& data = {});

/// Where a folder of data lies: in (or as) `given` if that is not empty; else in $TOFTWIN_DATA; else beside the
/// description; else in ../shared/data of a folder above the description or the working folder.
std::optional<std::filesystem::path> findData(const std::string& name, const std::filesystem::path& given,
                                              const std::filesystem::path& description);

/// The [[candidate]]s of a file: effects that a camera may lack.
Result<std::vector<EffectGroup>> loadCandidates(const std::filesystem::path& file);

}  // namespace toftwin::validate
