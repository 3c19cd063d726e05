// SPDX-License-Identifier: Apache-2.0
#include "calib/plan/opened.h"

#include <unistd.h>

#include <ctime>
#include <fstream>
#include <sstream>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "calib/compare/json_parse.h"
#include "calib/plan/compare_capture.h"

namespace toftwin::plan {
namespace {

/// Which notes speak of one of these cameras.
std::vector<OpenedOf> notesOn(OpenedOf cameras) {
  if (cameras == OpenedOf::Both) return {OpenedOf::Both, OpenedOf::A, OpenedOf::B};
  return {OpenedOf::Both, cameras};
}

Error openedBefore(const std::filesystem::path& run, OpenedOf cameras, std::istream& note) {
  std::stringstream text;
  text << note.rdbuf();
  const auto before = compare::parseJson(text.str());
  const auto said = [&](const char* key) {
    const compare::Json* found = before ? before->find(key) : nullptr;
    return found == nullptr ? std::string{"(unknown)"} : found->words();
  };
  const char* whose = cameras == OpenedOf::Both ? ""
                      : cameras == OpenedOf::A  ? " of camera A"
                                                : " of camera B";
  return {Error::Code::InvalidArgument,
          fmt::format(
              "{}: the locked captures{} were opened on {} for {}. What is judged on them twice is fitted "
              "to them; capture new ones",
              run.string(), whose, said("date"), said("report"))};
}

Error notWritten(const std::filesystem::path& file) {
  return {Error::Code::StorageFull,
          fmt::format("{}: cannot be written, so the locked captures stay closed", file.string())};
}

}  // namespace

std::string openedFile(OpenedOf cameras) {
  if (cameras == OpenedOf::Both) return kOpenedFile;
  return cameras == OpenedOf::A ? "opened-a.json" : "opened-b.json";
}

Result<> checkClosed(const std::filesystem::path& run, OpenedOf cameras) {
  for (const OpenedOf other : notesOn(cameras)) {
    if (std::ifstream note{run / openedFile(other)}; note) return openedBefore(run, other, note);
  }
  if (::access(run.c_str(), W_OK) != 0) return notWritten(run / openedFile(cameras));
  return {};
}

Result<> checkHashes(const std::filesystem::path& run, OpenedOf cameras,
                     const std::vector<CaptureRecord>& records) {
  for (const CaptureRecord& one : records) {
    if (cameras != OpenedOf::B)
      if (auto checked = checkHash(run, one.a); !checked) return checked;
    if (cameras != OpenedOf::A)
      if (auto checked = checkHash(run, one.b); !checked) return checked;
  }
  return {};
}

Result<> openLocked(const Opening& opening, const std::vector<CaptureRecord>& records) {
  if (auto closed = checkClosed(opening.run, opening.cameras); !closed) return closed;
  if (auto whole = checkHashes(opening.run, opening.cameras, records); !whole) return whole;
  const auto file = opening.run / openedFile(opening.cameras);
  compare::Json json = compare::Json::object();
  json.set("date", fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(std::time(nullptr))));
  json.set("report", opening.report.string()).set("note", opening.note);
  std::ofstream out{file};
  out << json.text();
  out.flush();
  if (out) return {};
  return notWritten(file);
}

}  // namespace toftwin::plan
