// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <utility>

#include <openssl/evp.h>

#include <fmt/format.h>

#include "calib/discover/rows_alike.h"
#include "calib/discover/table_data.h"

namespace toftwin::discover {
namespace {

/// Number of each row's capture, in the order in which they first stand there; the same name in two sessions
/// is two. Where no column names them, runs of equal values may be some.
std::vector<int> capturesInOrder(const TableData& data) {
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

/// Which units hold a session's first or last row: where a series that is gone through once is steepest. What only they
/// show would never be fitted.
std::vector<bool> endsOfSessions(const TableData& data, const std::vector<int>& unit, std::size_t units) {
  std::vector<bool> ends(units, false);
  for (std::size_t i = 0; i < data.rows(); ++i) {
    const bool is_first = i == 0 || data.session[i] != data.session[i - 1];
    const bool is_last = i + 1 == data.rows() || data.session[i] != data.session[i + 1];
    if (is_first || is_last) ends[unit.empty() ? i : static_cast<std::size_t>(unit[i])] = true;
  }
  return ends;
}

/// One block of every few, by `draw`, or the next one that holds no end.
std::size_t blockFrom(const std::vector<bool>& ends, std::size_t first, std::size_t size, std::size_t blocks,
                      std::size_t draw) {
  for (std::size_t next = 0; next < blocks; ++next) {
    const std::size_t begin = first + size * ((draw + next) % blocks), end = std::min(begin + size, ends.size());
    bool holds_end = false;
    for (std::size_t i = begin; i < end; ++i) holds_end = holds_end || ends[i];
    if (!holds_end) return begin;
  }
  return first + size * draw;
}

}  // namespace

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
  const std::vector<bool> ends = endsOfSessions(data, capture, units);
  for (std::size_t first = 0; first < units; first += size * every) {
    const std::size_t blocks = std::min(every, units);
    const std::size_t begin = blockFrom(ends, first, size, blocks, random() % blocks);
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
