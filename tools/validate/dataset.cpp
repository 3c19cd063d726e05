// SPDX-License-Identifier: Apache-2.0
#include "tools/validate/dataset.h"

#include <algorithm>
#include <cstdlib>
#include <initializer_list>
#include <iterator>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "protocol/settings/settings.h"
#include "tools/validate/free_numbers.h"

namespace toftwin::validate {
namespace {

namespace fs = std::filesystem;

void readEffects(settings::Table& table, std::vector<sim::AnyEffect>& effects) {
  for (settings::Table& one : table.tables("effect")) {
    const auto type = one.text("type");
    bool is_known = false;
    sim::AllEffects::forEach([&]<class E>() {
      if (!type || *type != E::about.name) return;
      is_known = true;
      E effect{};
      one.read(effect);
      effects.emplace_back(effect);
    });
    if (!is_known) one.complain("type", "must name an effect of docs/effects");
  }
}

/// Whether the number's keys are keys of the effects, and its bounds within theirs.
void checkKeys(settings::Table& table, const FreeNumber& number, const std::vector<sim::AnyEffect>& effects) {
  if (number.role != FreeNumber::Role::Effect) return;
  if (number.keys.empty() || number.keys.size() > effects.size())
    table.complain("number", fmt::format("\"{}\": keys must be one for each of the {} effects beside it, or fewer", number.name, effects.size()));
  for (const double value : {number.low, number.high}) {
    if (const std::string problem = problemOf(number, effects, value); !problem.empty())
      table.complain("number", fmt::format("\"{}\" = {}: {}", number.name, value, problem));
  }
}

void checkNumbers(settings::Table& table, const EffectGroup& group) {
  for (const FreeNumber& number : group.numbers) {
    if (!(number.low <= number.start && number.start <= number.high && number.low < number.high))
      table.complain("number", fmt::format("\"{}\": low ≤ start ≤ high and low < high are needed", number.name));
    if (!number.per.empty() && number.per.size() != number.keys.size())
      table.complain("number", fmt::format("\"{}\": as many of per as of keys", number.name));
    const bool is_albedo = number.role == FreeNumber::Role::Albedo;
    if (is_albedo && (number.values.size() < 2 || !std::ranges::is_sorted(number.values)))
      table.complain("number", fmt::format("\"{}\": values must be two albedos or more, ascending", number.name));
    if (number.per.empty() || number.per.size() == number.keys.size()) checkKeys(table, number, group.effects);
  }
}

/// Visitor that puts the camera's name in place of "{camera}" in all texts.
struct NameCamera {
  const std::string& name;

  void text(const char*, std::string& value, const char*) const {
    constexpr std::string_view kPlace = "{camera}";
    for (std::size_t at = value.find(kPlace); at != std::string::npos; at = value.find(kPlace, at + name.size()))
      value.replace(at, kPlace.size(), name);
  }
  void texts(const char* key, std::vector<std::string>& values, const char* help) const {
    for (std::string& value : values) text(key, value, help);
  }
  template <class Aggregate>
  void group(const char*, std::vector<Aggregate>& values, const char*) const {
    for (Aggregate& value : values) value.visit(*this);
  }
  template <class Number>
  void number(const char*, Number&, Bounds, const char*) const {}
  template <class Numbers>
  void numbers(const char*, Numbers&, Bounds, const char*) const {}
  void flag(const char*, bool&, const char*) const {}
  template <class Enum>
  void choice(const char*, Enum&, std::initializer_list<std::pair<const char*, Enum>>, const char*) const {}
};

/// Reads a judgement over what an earlier one says, if it is like one.
template <class Kind>
Judgement readKind(settings::Table& table, const Judgement* like) {
  Judgement judgement{Kind{}, {}};
  if (like != nullptr) judgement = *like;
  Kind& what = std::get<Kind>(judgement.what);
  EffectGroup& fitted = judgement.fitted;
  what.id.clear();
  table.read(what);
  if constexpr (requires { what.numbers; }) fitted.numbers = what.numbers;
  if (table.has("effect")) fitted.effects.clear(), readEffects(table, fitted.effects);
  checkNumbers(table, fitted);
  if (what.data.empty()) what.data = what.title;
  if (what.title.empty()) table.complain("title", "is missing");
  return judgement;
}

struct KindRow {
  const char* name;
  Judgement (*read)(settings::Table&, const Judgement*);
};
constexpr KindRow kKinds[] = {{"distances", readKind<Distances>},
                              {"series", readKind<Series>},
                              {"noise", readKind<Noise>},
                              {"line", readKind<Line>},
                              {"edges", readKind<Edges>}};

Heading& headingOf(Judgement& judgement) {
  return std::visit([](Heading& heading) -> Heading& { return heading; }, judgement.what);
}

/// The judgements of a file. One that is like another has its kind, and its keys where it has none of its own.
std::vector<Judgement> readJudgements(settings::Table& file) {
  std::vector<Judgement> all;
  for (settings::Table& table : file.tables("judge")) {
    const std::string like = table.text("like").value_or("");
    const auto model = std::ranges::find_if(all, [&](Judgement& one) { return headingOf(one).id == like; });
    if (!like.empty() && model == all.end()) table.complain("like", fmt::format("= \"{}\": no judgement above has that id", like));
    const auto kind = table.text("kind");
    const auto row = std::ranges::find_if(kKinds, [&](const KindRow& one) { return kind && *kind == one.name; });
    const bool is_like = model != all.end() && !kind;
    if (!is_like && row == std::end(kKinds)) {
      table.complain("kind", "must be one of: distances, series, noise, line, edges; or like = the id of a judgement above");
      table.acceptAll();
      continue;
    }
    const Judgement* const base = is_like ? &*model : nullptr;
    const KindRow& which = is_like ? kKinds[model->what.index()] : *row;
    Judgement judgement = which.read(table, base);
    Heading& heading = headingOf(judgement);
    if (heading.id.empty()) heading.id = fmt::format("{}-{}", which.name, heading.camera);
    all.push_back(std::move(judgement));
  }
  for (Judgement& one : all) {
    const std::string camera = headingOf(one).camera;
    NameCamera visitor{camera};
    std::visit([&](auto& what) { what.visit(visitor); }, one.what);
  }
  return all;
}

void readCamera(settings::Table& table, std::vector<Subject>& cameras) {
  const std::string name = table.text("name").value_or("");
  const auto file = table.text("file");
  auto model = file ? sim::SensorModel::load(table.resolve(*file)) : sim::SensorModel::preset(name);
  if (name.empty()) table.complain("name", "is missing: it is what [[judge]] calls the camera");
  if (!model) {
    table.complain(file ? "file" : "name", model.error().message);
    return;
  }
  cameras.push_back({name, table.text("title").value_or(name), *std::move(model)});
}

void checkCameras(settings::Table& table, const Dataset& set) {
  for (const Judgement& judgement : set.judgements) {
    const auto& name = std::visit([](const Heading& heading) -> const std::string& { return heading.camera; }, judgement.what);
    if (std::ranges::find(set.cameras, name, &Subject::name) == set.cameras.end())
      table.complain("judge", fmt::format("a judgement is of camera \"{}\", but no [[camera]] has that name", name));
  }
}

}  // namespace

const Subject& Dataset::camera(const std::string& name) const {
  return *std::ranges::find(cameras, name, &Subject::name);
}

std::optional<fs::path> findData(const std::string& name, const fs::path& given, const fs::path& description) {
  std::error_code ignored;
  const auto inside = [&](const fs::path& folder) -> std::optional<fs::path> {
    if (fs::is_directory(folder / name, ignored)) return folder / name;
    return std::nullopt;
  };
  if (!given.empty()) {
    if (auto found = inside(given)) return found;
    const bool is_it = fs::is_directory(given, ignored) && fs::weakly_canonical(given, ignored).filename() == name;
    return is_it ? std::optional{given} : std::nullopt;
  }
  if (const char* named = std::getenv("TOFTWIN_DATA"); named != nullptr && *named != '\0') return findData(name, named, {});
  const fs::path beside = fs::absolute(description, ignored).parent_path();
  if (auto found = inside(beside)) return found;
  for (fs::path folder : {beside, fs::current_path(ignored)}) {
    for (; folder.has_relative_path(); folder = folder.parent_path()) {
      if (auto found = inside(folder.parent_path() / "shared" / "data")) return found;
    }
  }
  return std::nullopt;
}

Result<Dataset> loadDataset(const fs::path& file, const fs::path& data) {
  auto table = settings::Table::load(file);
  if (!table) return table.error();
  Dataset set;
  set.file = file;
  set.title = table->text("title").value_or(file.stem().string());
  set.other = table->text("other").value_or(set.other);
  set.notes = table->texts("notes").value_or(std::vector<std::string>{});
  const std::string name = table->text("data").value_or(".");
  for (settings::Table& camera : table->tables("camera")) readCamera(camera, set.cameras);
  set.judgements = readJudgements(*table);
  if (set.judgements.empty()) table->complain("judge", "is missing: a [[judge]] says what is judged");
  checkCameras(*table, set);
  if (auto checked = table->check(); !checked) return checked.error();
  const auto folder = findData(name, data, file);
  if (!folder) {
    return Error{Error::Code::NotFound,
                 fmt::format("{}: there is no folder \"{}\" of data {}; name the folder that holds it with --data", file.string(),
                             name, data.empty() ? "in TOFTWIN_DATA, beside the file or in ../shared/data" : "in " + data.string())};
  }
  set.folder = *folder;
  return set;
}

Result<std::vector<EffectGroup>> loadCandidates(const fs::path& file) {
  auto table = settings::Table::load(file);
  if (!table) return table.error();
  std::vector<EffectGroup> groups;
  for (settings::Table& one : table->tables("candidate")) {
    EffectGroup group;
    group.name = one.text("name").value_or("");
    readEffects(one, group.effects);
    for (settings::Table& number : one.tables("number")) {
      number.read(group.numbers.emplace_back());
      if (!(group.numbers.back().step > 0.0)) number.complain("step", "is missing");
    }
    checkNumbers(one, group);
    groups.push_back(std::move(group));
  }
  if (auto checked = table->check(); !checked) return checked.error();
  return groups;
}

}  // namespace toftwin::validate
