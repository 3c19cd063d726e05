// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/run_index.h"

#include <openssl/evp.h>

#include <array>
#include <cmath>
#include <fstream>
#include <memory>

#include <fmt/format.h>
#include <toftwin/nan.h>

#include "calib/compare/json.h"
#include "calib/compare/json_parse.h"
#include "calib/plan/place.h"

namespace toftwin::plan {
namespace {

using compare::Json;

Json toJson(const RecordedFile& file, const TakenBy& by) {
  Json temperatures = Json::object();
  for (const NamedTemperature& one : by.temperatures) temperatures.set(one.where, one.value.in(celsius));
  Json json = Json::object();
  json.set("file", file.file).set("sha256", file.sha256).set("source", by.source).set("model", by.model);
  json.set("frames", by.frames)
      .set("since_power_on_s", by.since_power_on ? by.since_power_on->in(second) : kNaN);
  json.set("temperatures_c", std::move(temperatures))
      .set("ambient_klx", by.ambient ? by.ambient->in(kilolux) : kNaN);
  json.set("exposure_us", by.exposure ? by.exposure->in(microsecond) : kNaN);
  return json;
}

Json toJson(const std::optional<Transform<World, Camera>>& pose) {
  if (!pose) return {};
  const Vec3d& t = pose->translation_m;
  Json json = Json::object();
  json.set("position_m", Json::arrayOf(std::array{t.x, t.y, t.z}));
  json.set("rotation_wxyz", Json::arrayOf(pose->rotation_wxyz));
  return json;
}

std::optional<Transform<World, Camera>> poseOf(const Json* json) {
  if (json == nullptr) return std::nullopt;
  const Json *position = json->find("position_m"), *rotation = json->find("rotation_wxyz");
  if (position == nullptr || rotation == nullptr || position->size() != 3 || rotation->size() != 4)
    return std::nullopt;
  Transform<World, Camera> pose;
  pose.translation_m = {position->at(0).number(), position->at(1).number(), position->at(2).number()};
  for (std::size_t i = 0; i < 4; ++i) pose.rotation_wxyz[i] = rotation->at(i).number();
  return pose;
}

/// Members of an object, with what stands for missing ones; `is_whole` turns false where one that must be
/// there is not.
struct Members {
  const Json& json;
  bool is_whole = true;

  std::string text(const char* key) {
    const Json* found = json.find(key);
    if (found == nullptr || !found->isText()) is_whole = false;
    return found == nullptr ? "" : found->words();
  }
  double number(const char* key) const {
    const Json* found = json.find(key);
    return found == nullptr ? kNaN : found->number();
  }
  /// A whole number that an index or a count can be.
  std::uint64_t count(const char* key) {
    const double value = number(key);
    if (value >= 0.0 && value < 1e15 && value == std::floor(value)) return static_cast<std::uint64_t>(value);
    is_whole = false;
    return 0;
  }
};

/// Names of files of ours: no way out of the run's folder.
bool isOurs(const std::string& file) {
  const std::filesystem::path path{file};
  return !file.empty() && path.is_relative() && file.find("..") == std::string::npos;
}

std::optional<RecordedFile> fileOf(const Json* json) {
  if (json == nullptr) return std::nullopt;
  Members members{*json};
  RecordedFile file{members.text("file"), members.text("sha256"), members.text("source"),
                    members.count("frames"), members.number("since_power_on_s")};
  return members.is_whole && isOurs(file.file) ? std::optional{file} : std::nullopt;
}

std::optional<std::array<double, 6>> halfWidthsOf(const Json* json) {
  if (json == nullptr || json->size() != 6) return std::nullopt;
  std::array<double, 6> widths{};
  for (std::size_t i = 0; i < 6; ++i) widths[i] = json->at(i).number();
  return widths;
}

std::optional<CaptureRecord> recordOf(const Json& json) {
  Members members{json};
  CaptureRecord one;
  one.number = members.count("number"), one.condition = members.count("condition");
  one.block = members.text("block"), one.kind = members.text("kind"), one.name = members.text("name");
  one.repeat = static_cast<int>(members.count("repeat")), one.is_locked = members.count("locked") != 0;
  if (std::isfinite(members.number("again"))) one.again = members.count("again");
  one.start_s = members.number("start_s"),
  one.began_ns = static_cast<std::int64_t>(members.number("began_ns"));
  one.distance_m = members.number("distance_m"), one.angle_deg = members.number("angle_deg");
  one.exposure_us = members.number("exposure_us"), one.ambient_klx = members.number("ambient_klx");
  one.pose = poseOf(json.find("pose")), one.pose_by = members.text("pose_by");
  one.pose_half_widths = halfWidthsOf(json.find("pose_half_widths_rad_m"));
  one.pose_of_b_half_widths = halfWidthsOf(json.find("pose_of_b_half_widths_rad_m"));
  one.pose_of_b = poseOf(json.find("pose_of_b"));
  const auto a = fileOf(json.find("a")), b = fileOf(json.find("b"));
  if (!a || !b || !members.is_whole) return std::nullopt;
  one.a = *a, one.b = *b;
  if (const Json* notes = json.find("notes"); notes != nullptr) {
    for (std::size_t i = 0; i < notes->size(); ++i) one.notes.push_back(notes->at(i).words());
  }
  return one;
}

}  // namespace

std::string lineOf(const Plan& plan, const PlannedCapture& planned, const Taken& taken, const RecordedFile& a,
                   const RecordedFile& b) {
  const BlockSpec& block = plan.blocks[planned.block];
  Sight sight{planned.distance_m, planned.angle_deg};
  if (taken.seen) {
    compare::PoseSpec seen;
    const Vec3d& t = taken.pose->translation_m;
    seen.position_m = {t.x, t.y, t.z}, seen.rotation_wxyz = taken.pose->rotation_wxyz;
    sight = sightOf(targetOf(plan, block), seen);
  }
  const Duration exposure = taken.a.exposure.value_or(planned.exposure);
  Json json = Json::object();
  json.set("number", planned.number).set("block", block.name).set("kind", std::string{nameOf(block.kind)});
  json.set("name", planned.name).set("condition", planned.condition).set("repeat", planned.repeat);
  json.set("locked", planned.is_locked ? 1 : 0).set("again", planned.again ? Json{*planned.again} : Json{});
  json.set("start_s", planned.start.in(second)).set("began_ns", taken.began_ns);
  json.set("distance_m", sight.distance_m).set("angle_deg", sight.angle_deg);
  json.set("exposure_us", exposure.in(microsecond)).set("ambient_klx", planned.ambient.in(kilolux));
  json.set("corner_deg", block.corner_deg).set("speed_m_per_s", block.speed_m_per_s);
  json.set("pose", toJson(taken.pose)).set("pose_by", taken.pose_by);
  if (taken.seen) {
    json.set("pose_seen", taken.seen->what)
        .set("pose_half_widths_rad_m", Json::arrayOf(taken.seen->half_widths));
  }
  if (taken.seen_by_b) {
    json.set("pose_of_b", toJson(std::optional{taken.seen_by_b->world_from_camera}))
        .set("pose_of_b_half_widths_rad_m", Json::arrayOf(taken.seen_by_b->half_widths));
  }
  json.set("a", toJson(a, taken.a)).set("b", toJson(b, taken.b));
  json.set("rig", taken.rig).set("notes", Json::arrayOf(taken.notes));
  return json.line();
}

Result<std::map<std::size_t, CaptureRecord>> readIndex(const std::filesystem::path& file) {
  std::ifstream in{file, std::ios::binary};
  if (!in) {
    return Error{
        Error::Code::NotFound,
        fmt::format("{}: cannot be read: is this the folder of a run of `toftwin measure`?", file.string())};
  }
  std::map<std::size_t, CaptureRecord> records;
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    const bool is_torn = in.eof();  // no end of line: the last, cut by a kill
    const auto json = compare::parseJson(line);
    auto record = json ? recordOf(*json) : std::nullopt;
    if (record)
      records[record->number] = *std::move(record);
    else if (!is_torn) {
      return Error{Error::Code::Malformed,
                   fmt::format("{}:{}: is no capture{}; remove the line to have it captured again",
                               file.string(), number, json ? "" : ": " + json.error().message)};
    }
  }
  return records;
}

Result<std::string> sha256Of(const std::filesystem::path& file) {
  std::ifstream in{file, std::ios::binary};
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context{EVP_MD_CTX_new(), &EVP_MD_CTX_free};
  if (!context || EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr) != 1) {
    return Error{Error::Code::Internal, "OpenSSL gives no SHA-256"};
  }
  std::vector<char> part(1 << 20);
  while (in) {
    in.read(part.data(), static_cast<std::streamsize>(part.size()));
    EVP_DigestUpdate(context.get(), part.data(), static_cast<std::size_t>(in.gcount()));
  }
  if (!in.eof()) return Error{Error::Code::NotFound, fmt::format("{}: cannot be read", file.string())};
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  EVP_DigestFinal_ex(context.get(), digest.data(), &size);
  std::string hex;
  for (unsigned i = 0; i < size; ++i) hex += fmt::format("{:02x}", digest[i]);
  return hex;
}

}  // namespace toftwin::plan
