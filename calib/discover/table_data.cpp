// SPDX-License-Identifier: Apache-2.0
#include "calib/discover/table_data.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <utility>

#include <openssl/evp.h>

#include <fmt/format.h>

#include "calib/discover/headers.h"
#include "calib/discover/row_checks.h"
#include "calib/discover/rows_alike.h"
#include "calib/discover/table_field.h"

namespace toftwin::discover {
namespace {

constexpr std::size_t kFewestRows = 20, kMostWords = 12;

/// Reads columns of a CsvTable; errors name file and line.
class NamedColumns {
 public:
  NamedColumns(const CsvTable& table, const std::filesystem::path& file) : table_(table), file_(file) {}

  [[nodiscard]] std::optional<std::size_t> find(const std::string& name) const {
    const auto at = std::ranges::find(table_.header, name);
    if (at == table_.header.end()) return std::nullopt;
    return static_cast<std::size_t>(at - table_.header.begin());
  }
  [[nodiscard]] Error missing(const std::string& name) const {
    return {Error::Code::NotFound, fmt::format("{}: has no column \"{}\", only: {}", file_.string(), name,
                                               fmt::join(table_.header, ", "))};
  }
  [[nodiscard]] const std::vector<std::string>& text(const std::string& name) const {
    return table_.columns[*find(name)];
  }
  /// NaN where a field says that there is none. Times become seconds since the first of them.
  [[nodiscard]] Result<std::vector<double>> numbers(const std::string& name) const {
    auto values = asWritten(name);
    if (values && isTime(name))
      for (const double first = firstOf(*values); double& value : *values) value -= first;
    return values;
  }
  static double firstOf(const std::vector<double>& values) {
    double first = std::numeric_limits<double>::infinity();
    for (const double value : values) first = std::fmin(first, value);
    return first;
  }
  /// Times are seconds since 1970, or since midnight.
  [[nodiscard]] Result<std::vector<double>> asWritten(const std::string& name) const {
    const auto at = find(name);
    if (!at) return missing(name);
    const bool is_time = isTime(name);
    std::vector<double> values;
    for (std::size_t row = 0; row < table_.rows(); ++row) {
      const std::string& field = table_.columns[*at][row];
      const auto number = toNumber(field), value = number || !is_time ? number : secondsIn(field);
      if (!value) {
        return Error{
            Error::Code::Malformed,
            fmt::format("{}:{}: \"{}\" in column \"{}\" is not a number{}", file_.string(), table_.line[row],
                        field.substr(0, 40), name,
                        hasThousandsPoint(field) ? ": write it without the points that part thousands" : "")};
      }
      values.push_back(*value);
    }
    if (const auto row = thousandOrNot(*at)) {
      return Error{Error::Code::Malformed,
                   fmt::format("{}:{}: \"{}\" in column \"{}\" may be a thousand or a fraction, beside whole numbers; "
                               "write it without the comma, or all with decimals",
                               file_.string(), table_.line[*row], table_.columns[*at][*row], name)};
    }
    if (is_time) overMidnight(values);
    return values;
  }
  /// The first "1,020" in a column with "950", where commas may be those of decimals: none is guessed.
  [[nodiscard]] std::optional<std::size_t> thousandOrNot(std::size_t column) const {
    if (table_.separator == ',') return std::nullopt;
    bool has_whole = false;
    std::optional<std::size_t> first;
    for (std::size_t row = 0; row < table_.rows(); ++row) {
      std::string_view field = table_.columns[column][row];
      if (!field.empty() && (field.front() == '-' || field.front() == '+')) field.remove_prefix(1);
      const bool is_number = !field.empty() && field.find_first_not_of("0123456789,") == std::string_view::npos;
      const std::size_t comma = field.find(',');
      if (is_number && comma == std::string_view::npos) has_whole = true;
      if (is_number && comma != std::string_view::npos && comma + 4 == field.size() && field.front() != '0' && !first)
        first = row;
    }
    return has_whole ? first : std::nullopt;
  }
  /// Times of day that fall by more than half a day are those of the next one. Dates do not fall so.
  static void overMidnight(std::vector<double>& seconds) {
    constexpr double kDay = 86'400.0;
    double days = 0.0, before = std::nan("");
    for (double& value : seconds) {
      if (std::isnan(value) || value > kDay) continue;
      if (value < before - 0.5 * kDay) days += kDay;
      before = value;
      value += days;
    }
  }
  [[nodiscard]] std::optional<double> toNumber(std::string_view field) const {
    return numberIn(field, table_.separator != ',');
  }
  [[nodiscard]] bool isText(const std::string& name) const {
    return !isTime(name) &&
           std::ranges::any_of(text(name), [&](const std::string& field) { return !toNumber(field); });
  }
  /// Times of day or dates, but for fields that say nothing.
  [[nodiscard]] bool isTime(const std::string& name) const {
    bool has_any = false;
    for (const std::string& field : text(name)) {
      if (secondsIn(field))
        has_any = true;
      else if (const auto value = toNumber(field); !value || !std::isnan(*value))
        return false;
    }
    return has_any;
  }

 private:
  const CsvTable& table_;
  const std::filesystem::path& file_;
};

/// Numbers for names, in the order in which they first stand there.
std::vector<int> numbered(const std::vector<std::string>& words, std::vector<std::string>& names) {
  std::map<std::string, int> known;
  std::vector<int> numbers;
  for (const std::string& word : words) {
    const auto [at, is_new] = known.try_emplace(word, static_cast<int>(known.size()));
    if (is_new) names.push_back(word);
    numbers.push_back(at->second);
  }
  return numbers;
}

const std::map<std::string, double, std::less<>> kPerMetre{{"m", 1.0}, {"cm", 1e2}, {"mm", 1e3}, {"um", 1e6}};

/// What a reference is multiplied with to be in the unit of what was measured; 1 where a header tells no
/// length.
double lengthFactor(const std::string& from, const std::string& to) {
  const auto a = kPerMetre.find(from), b = kPerMetre.find(to);
  return a == kPerMetre.end() || b == kPerMetre.end() ? 1.0 : b->second / a->second;
}

Result<> readErrors(const NamedColumns& columns, const Roles& roles, TableData& data) {
  if (!roles.error.empty()) {
    auto error = columns.numbers(roles.error);
    if (!error) return error.error();
    data.error = *std::move(error);
    if (roles.is_reversed)
      for (double& one : data.error) one = -one;
    data.unit = unitOf(roles.error);
  }
  if (!roles.reference.empty()) {
    auto reference = columns.numbers(roles.reference);
    if (!reference) return reference.error();
    data.reference = *std::move(reference), data.reference_name = roles.reference;
  }
  if (roles.error.empty()) {
    auto measured = columns.numbers(roles.measured);
    if (!measured) return measured.error();
    data.error = *std::move(measured);
    data.unit = unitOf(roles.measured);
    const std::string unit = unitOf(roles.reference);
    const double factor = lengthFactor(unit, data.unit);
    if (factor != 1.0)
      data.notes.push_back(
          fmt::format("the reference is in {}, what was measured in {}: converted", unit, data.unit));
    for (std::size_t i = 0; i < data.reference.size(); ++i) data.error[i] -= factor * data.reference[i];
  }
  return {};
}

bool areWhole(const std::vector<double>& values) {
  return std::ranges::all_of(values, [](double v) { return !std::isfinite(v) || v == std::floor(v); });
}

Result<> readCovariate(const NamedColumns& columns, const std::string& name, MapNature said,
                       TableData& data) {
  if (!columns.find(name)) return columns.missing(name);
  TableCovariate covariate{name, natureOf(name, said), {}, {}};
  const bool is_text = columns.isText(name);
  if (is_text || covariate.nature == Nature::Category) {
    if (is_text && said != MapNature::Guessed && said != MapNature::Category) {
      auto error = columns.numbers(name);
      return error.error();
    }
    const auto numbers = numbered(columns.text(name), covariate.words);
    if (covariate.words.size() > kMostWords) {
      data.doubts.push_back(fmt::format("column \"{}\" holds {} different texts, more than {}: left out",
                                        name, covariate.words.size(), kMostWords));
      return {};
    }
    covariate.nature = Nature::Category;
    covariate.values.assign(numbers.begin(), numbers.end());
  } else {
    auto values = columns.numbers(name);
    if (!values) return values.error();
    covariate.values = *std::move(values);
    if (said == MapNature::Guessed && isPixelNumber(name) && areWhole(covariate.values))
      covariate.nature = Nature::Index;
    if (columns.isTime(name)) {
      covariate.first = NamedColumns::firstOf(*columns.asWritten(name));
      if (said == MapNature::Guessed) covariate.nature = Nature::Time;
    }
  }
  data.covariates.push_back(std::move(covariate));
  return {};
}

/// Covariates that cannot show anything: they never change.
void dropConstant(TableData& data) {
  std::erase_if(data.covariates, [&](const TableCovariate& covariate) {
    std::set<double> values(covariate.values.begin(), covariate.values.end());
    if (values.size() > 1) return false;
    data.doubts.push_back(
        fmt::format("column \"{}\" never changes: what goes with it cannot be seen", covariate.name));
    return true;
  });
}

/// Rows in which everything that is used is there.
std::vector<bool> complete(const TableData& data) {
  std::vector<bool> is_complete(data.rows(), true);
  const auto need = [&](const std::vector<double>& values) {
    for (std::size_t i = 0; i < values.size(); ++i)
      if (!std::isfinite(values[i])) is_complete[i] = false;
  };
  need(data.error), need(data.reference), need(data.sigma);
  for (const TableCovariate& covariate : data.covariates) need(covariate.values);
  for (std::size_t i = 0; i < data.sigma.size(); ++i)
    if (!(data.sigma[i] > 0.0)) is_complete[i] = false;
  return is_complete;
}

/// A column that is empty in most rows would take the rows with it.
void dropSparse(TableData& data) {
  std::erase_if(data.covariates, [&](const TableCovariate& covariate) {
    const auto missing = std::ranges::count_if(covariate.values, [](double v) { return !std::isfinite(v); });
    if (2 * static_cast<std::size_t>(missing) <= covariate.values.size()) return false;
    data.doubts.push_back(fmt::format("column \"{}\" is empty in {} of {} rows: left out", covariate.name,
                                      missing, covariate.values.size()));
    return true;
  });
}

/// Speed of light over twice the frequency, in the unit of a header.
double periodIn(Frequency modulation, const std::string& unit) {
  if (!(modulation > Frequency{})) return 0.0;
  const double metres = 299'792'458.0 / (2.0 * modulation.in(hertz));
  const auto found = kPerMetre.find(unit);
  return metres * (found == kPerMetre.end() ? 1.0 : found->second);
}

/// A column that could name sessions, beside one that does, and that names at least two groups in each on
/// average: rows of such a run may err alike. Then it is no covariate.
void takeFinerGroup(const NamedColumns& columns, Roles& roles, TableData& data) {
  for (const std::string& name : roles.other_groups) {
    if (!roles.capture.empty()) return;
    std::vector<std::string> names;
    const auto runs = numbered(columns.text(name), names);
    std::set<std::pair<int, int>> groups;
    for (std::size_t i = 0; i < runs.size(); ++i) groups.emplace(data.session[i], runs[i]);
    if (groups.size() < 2 * data.session_names.size() || 2 * groups.size() > data.rows()) continue;
    roles.capture = name, data.capture = runs;
    std::erase_if(roles.covariates, [&](const auto& one) { return one.first == name; });
  }
}

Result<> readGroups(const NamedColumns& columns, Roles& roles, TableData& data) {
  if (!roles.sigma.empty()) {
    auto sigma = columns.numbers(roles.sigma);
    if (!sigma) return sigma.error();
    data.sigma = *std::move(sigma);
  }
  for (const std::string* name : {&roles.session, &roles.capture})
    if (!name->empty() && !columns.find(*name)) return columns.missing(*name);
  if (roles.session.empty()) {
    data.session.assign(data.rows(), 0), data.session_names = {"all"};
  } else {
    data.session = numbered(columns.text(roles.session), data.session_names);
  }
  std::vector<std::string> ignored;
  if (!roles.capture.empty()) data.capture = numbered(columns.text(roles.capture), ignored);
  takeFinerGroup(columns, roles, data);
  data.locked.assign(data.rows(), false);
  if (roles.locked.empty()) return {};
  auto locked = columns.numbers(roles.locked);
  if (!locked) return locked.error();
  data.has_locked_column = true;
  for (std::size_t i = 0; i < data.rows(); ++i)
    data.locked[i] = std::abs((*locked)[i]) > 0.0;  // not where nothing is said
  return {};
}

/// Columns that have no part, or none any more.
void listLeftOut(const CsvTable& table, const TableData& data, Roles& roles) {
  std::erase_if(roles.covariates, [&](const auto& one) {
    return std::ranges::find(data.covariates, one.first, &TableCovariate::name) == data.covariates.end();
  });
  for (const std::string& name : table.header) {
    const std::array used{roles.measured, roles.reference, roles.error, roles.sigma,
                          roles.session,  roles.capture,   roles.locked};
    const auto isIt = [&](const auto& one) { return one.first == name; };
    if (std::ranges::find(used, name) == used.end() && std::ranges::none_of(roles.covariates, isIt))
      roles.left_out.push_back(name);
  }
}

void note(const Roles& roles, TableData& data) {
  data.notes.insert(data.notes.begin(), roles.inWords());
  if (data.session_names.size() == 1) {
    data.doubts.push_back("one session only: what is found may be of this session; measure another to know");
  }
  if (data.reference.empty() && roles.error.empty()) {
    data.doubts.push_back(
        "no reference: only changes of the measured value are seen, not whether it is right");
  }
}

}  // namespace

Result<TableData> readTable(const CsvTable& table, const TableMap& map, const std::filesystem::path& file) {
  const NamedColumns columns{table, file};
  auto roles = rolesOf(table.header, map, file);
  if (!roles) return roles.error();
  TableData data;
  data.file = file, data.line = table.line;
  if (auto done = readErrors(columns, *roles, data); !done) return done.error();
  if (auto done = readGroups(columns, *roles, data); !done) return done.error();
  for (const auto& [name, nature] : roles->covariates)
    if (auto done = readCovariate(columns, name, nature, data); !done) return done.error();
  dropSparse(data);
  const std::size_t before = data.rows();
  data = rowsOf(data, complete(data));
  if (data.rows() < before) {
    data.doubts.push_back(fmt::format("{} of {} rows have an empty, infinite or impossible value: left out",
                                      before - data.rows(), before));
  }
  data.period = periodIn(map.modulation, unitOf(roles->reference.empty() ? roles->error : roles->reference));
  const double scale = lengthFactor(unitOf(roles->reference), data.unit);
  setInvalidAside(data, scale);
  if (data.rows() < kFewestRows) {
    return Error{Error::Code::InvalidArgument, fmt::format("{}: has {} usable rows; at least {} are needed",
                                                           file.string(), data.rows(), kFewestRows)};
  }
  dropConstant(data);
  dropCopies(data, scale);
  if (data.covariates.empty()) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("{}: has no column that changes and that the error could go with, besides {}",
                             file.string(), roles->inWords())};
  }
  listLeftOut(table, data, *roles);
  note(*roles, data);
  if (table.is_from_windows) data.notes.push_back("the file is no UTF-8: read as Windows-1252 (Latin-1)");
  return data;
}

TableData rowsOf(const TableData& data, const std::vector<bool>& wanted) {
  TableData out = data;
  const auto keep = [&](auto& values) {
    std::size_t next = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
      if (wanted[i]) values[next++] = values[i];
    values.resize(next);
  };
  keep(out.error), keep(out.reference), keep(out.sigma), keep(out.session), keep(out.capture),
      keep(out.locked);
  keep(out.line);
  for (TableCovariate& covariate : out.covariates) keep(covariate.values);
  return out;
}

/// Number of each row's capture, in the order in which they first stand there; the same name in two sessions
/// is two. Where no column names them, runs of equal values may be some.
static std::vector<int> capturesInOrder(const TableData& data) {
  if (data.capture.empty()) {
    auto runs = runsOfEqualValues(data);
    return runs.empty() ? std::vector<int>{} : std::move(runs.front().run);
  }
  std::map<std::pair<int, int>, int> known;
  std::vector<int> numbers;
  for (std::size_t i = 0; i < data.capture.size(); ++i)
    numbers.push_back(
        known.try_emplace({data.session[i], data.capture[i]}, static_cast<int>(known.size())).first->second);
  return numbers;
}

void lock(TableData& data, const TableMap& map) {
  if (data.has_locked_column) return;
  std::mt19937_64 random{map.seed + 77};
  const auto sessions = data.session_names.size();
  if (sessions >= 5) {
    std::vector<std::size_t> order(sessions);
    for (std::size_t i = 0; i < sessions; ++i) order[i] = i;
    for (std::size_t i = sessions - 1; i > 0; --i) std::swap(order[i], order[random() % (i + 1)]);
    order.resize(
        std::max<std::size_t>(1, static_cast<std::size_t>(map.locked_share * static_cast<double>(sessions))));
    for (std::size_t i = 0; i < data.rows(); ++i)
      data.locked[i] = std::ranges::find(order, static_cast<std::size_t>(data.session[i])) != order.end();
    data.notes.push_back(fmt::format("{} of {} sessions are locked", order.size(), sessions));
    return;
  }
  // Blocks of captures, or rows, that follow each other: one of every `every` is drawn.
  const auto capture = capturesInOrder(data);
  const std::size_t units =
      capture.empty() ? data.rows() : 1 + static_cast<std::size_t>(*std::ranges::max_element(capture));
  const auto every = static_cast<std::size_t>(std::lround(1.0 / map.locked_share));
  const std::size_t size = std::max<std::size_t>(1, units / (8 * every));
  std::vector<bool> is_drawn(units, false);
  for (std::size_t first = 0; first < units; first += size * every) {
    const std::size_t begin = first + size * (random() % std::min(every, units));
    for (std::size_t i = begin; i < std::min(begin + size, units); ++i) is_drawn[i] = true;
  }
  for (std::size_t i = 0; i < data.rows(); ++i)
    data.locked[i] = is_drawn[capture.empty() ? i : static_cast<std::size_t>(capture[i])];
  data.doubts.push_back(
      "locked rows are of the same sessions as the others, because there are fewer than five");
}

std::string hashOf(const TableData& data) {
  EVP_MD_CTX* context = EVP_MD_CTX_new();
  EVP_DigestInit_ex(context, EVP_sha256(), nullptr);
  const auto add = [&](const auto& values) {
    for (const auto& value : values) {
      const double number = static_cast<double>(value);
      EVP_DigestUpdate(context, &number, sizeof number);
    }
  };
  add(data.line), add(data.error), add(data.reference), add(data.sigma), add(data.session);
  for (const TableCovariate& covariate : data.covariates) add(covariate.values);
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned length = 0;
  EVP_DigestFinal_ex(context, digest, &length);
  EVP_MD_CTX_free(context);
  std::string hex;
  for (unsigned i = 0; i < length; ++i) hex += fmt::format("{:02x}", digest[i]);
  return hex;
}

}  // namespace toftwin::discover
