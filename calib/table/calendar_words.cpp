// SPDX-License-Identifier: Apache-2.0
#include "calib/table/calendar_words.h"

#include <algorithm>
#include <array>
#include <string>

#include "calib/table/number.h"

namespace toftwin::table {

int monthOf(std::string_view word) {
  struct Month {
    std::string_view begins;
    int number;
  };
  constexpr std::array kMonths{
      Month{"jan", 1},  Month{"ene", 1},  Month{"gen", 1},  Month{"feb", 2},  Month{"fev", 2},
      Month{"mar", 3},  Month{"apr", 4},  Month{"avr", 4},  Month{"abr", 4},  Month{"may", 5},
      Month{"mai", 5},  Month{"mag", 5},  Month{"jun", 6},  Month{"juin", 6}, Month{"giu", 6},
      Month{"jul", 7},  Month{"juil", 7}, Month{"lug", 7},  Month{"aug", 8},  Month{"aou", 8},
      Month{"ago", 8},  Month{"sep", 9},  Month{"set", 9},  Month{"oct", 10}, Month{"okt", 10},
      Month{"ott", 10}, Month{"nov", 11}, Month{"dec", 12}, Month{"dez", 12}, Month{"dic", 12}};
  const std::string small = folded(word);
  for (const Month& one : kMonths)
    if (small.starts_with(one.begins)) return one.number;
  return 0;
}

bool isWeekday(std::string_view word) {
  constexpr std::array<std::string_view, 24> kBegin{"mon", "tue", "wed", "thu", "fri", "sat", "sun", "die",
                                                    "mit", "don", "fre", "sam", "son", "lun", "mer", "jeu",
                                                    "ven", "dim", "mie", "jue", "vie", "sab", "dom", "gio"};
  constexpr std::array<std::string_view, 8> kWhole{"mo", "di", "mi", "do", "fr", "sa", "so", "mar"};
  const std::string small = folded(word);
  return std::ranges::find(kWhole, small) != kWhole.end() || small.starts_with("mart") ||
         std::ranges::any_of(kBegin, [&](std::string_view one) { return small.starts_with(one); });
}

std::optional<double> hoursAhead(std::string_view word) {
  struct Zone {
    std::string_view name;
    double hours;
  };
  constexpr std::array kZones{Zone{"z", 0},    Zone{"utc", 0},  Zone{"gmt", 0},  Zone{"cet", 1},
                              Zone{"cest", 2}, Zone{"mez", 1},  Zone{"mesz", 2}, Zone{"bst", 1},
                              Zone{"eet", 2},  Zone{"eest", 3}, Zone{"est", -5}, Zone{"edt", -4},
                              Zone{"cst", -6}, Zone{"cdt", -5}, Zone{"mst", -7}, Zone{"mdt", -6},
                              Zone{"pst", -8}, Zone{"pdt", -7}, Zone{"jst", 9}};
  const std::string small = folded(word);
  const auto at = std::ranges::find(kZones, small, &Zone::name);
  return at == kZones.end() ? std::nullopt : std::optional{at->hours};
}

}  // namespace toftwin::table
