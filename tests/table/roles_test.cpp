// SPDX-License-Identifier: Apache-2.0
// Which column is what: by words of five languages, by a map, and what is asked.
#include <gmock/gmock.h>

#include <fmt/format.h>

#include "calib/table/readings.h"

namespace toftwin::table {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

/// Forty rows of small numbers that nothing follows; under `categories` names.
std::string tableOf(const std::vector<std::string>& header, char delimiter = ';') {
  std::string text = fmt::format("{}\n", fmt::join(header, std::string{delimiter}));
  for (int i = 0; i < 40; ++i) {
    for (std::size_t c = 0; c < header.size(); ++c)
      text += fmt::format("{}{}", c == 0 ? "" : std::string{delimiter},
                          (i * 7 + static_cast<int>(c) * 3 + i / 5) % 11 % 2);
    text += '\n';
  }
  return text;
}

std::string rolesIn(const std::vector<std::string>& header, const TableMap& map = {}) {
  const auto read = parseReadings(tableOf(header), map, "t.csv");
  return read ? read->notes.front() : read.error().message;
}

TEST(Roles, AreSaidByHeaders) {
  EXPECT_EQ(rolesIn({"time_s", "depth_mm"}), "error = depth_mm (without a reference); covariates: time_s");
  EXPECT_EQ(rolesIn({"reference_mm", "reference_minus_measured_mm"}),
            "error = −reference_minus_measured_mm; covariates: none");
  EXPECT_EQ(rolesIn({"measured_mm", "reference_mm", "sigma_mm", "run", "locked", "temperature_c"}),
            "error = measured_mm − reference_mm; sigma = sigma_mm; session = run; locked = locked; "
            "covariates: temperature_c");
  EXPECT_EQ(rolesIn({"range_error_mm", "distance_m", "exposure_time_us"}),
            "error = range_error_mm; covariates: distance_m, exposure_time_us");
  EXPECT_EQ(rolesIn({"nominal_mm", "actual_mm", "t_s"}), "error = actual_mm − nominal_mm; covariates: t_s");
  EXPECT_EQ(rolesIn({"depth_mm", "standard_deviation_mm", "t_s"}),
            "error = depth_mm (without a reference); sigma = standard_deviation_mm; covariates: t_s");
  EXPECT_EQ(rolesIn({"measured_mm", "bias_V", "reference_mm"}),
            "error = measured_mm − reference_mm; covariates: bias_V");
  EXPECT_THAT(rolesIn({"a", "b"}), HasSubstr("which column was measured?"));
  EXPECT_THAT(rolesIn({"measured_left_mm", "measured_right_mm"}),
              HasSubstr("which column was measured: measured_left_mm, measured_right_mm?"));
}

TEST(Roles, AreSaidInFiveLanguages) {
  for (const std::vector<std::string>& header : std::vector<std::vector<std::string>>{
           {"measured [mm]", "reference [mm]", "session", "capture", "noise [mm]", "time [s]"},
           {"Messwert [mm]", "Referenz [mm]", "Sitzung", "Aufnahme", "Streuung [mm]", "Zeit [s]"},
           {"Mesure [mm]", "Référence [mm]", "Séance", "Prise", "Écart-type [mm]", "Temps [s]"},
           {"Medido [mm]", "Referencia [mm]", "Sesión", "Captura", "Desviación estándar [mm]", "Tiempo [s]"},
           {"Misurato [mm]", "Riferimento [mm]", "Sessione", "Acquisizione", "Rumore [mm]", "Tempo [s]"}}) {
    EXPECT_EQ(rolesIn(header),
              fmt::format("error = {} − {}; sigma = {}; session = {}; capture = {}; covariates: {}",
                          header[0], header[1], header[4], header[2], header[3], header[5]));
    const auto read = parseReadings(tableOf(header), {}, "t.csv");
    ASSERT_TRUE(read);
    EXPECT_EQ(read->covariates.back().nature, Nature::Time);
  }
}

TEST(Roles, TheLikeliestWordNamesTheSession) {
  EXPECT_THAT(rolesIn({"error_mm", "day", "session", "t_s"}),
              StartsWith("error = error_mm; session = session;"));
  EXPECT_THAT(rolesIn({"error_mm", "run", "day"}), StartsWith("error = error_mm; session = run"));
  EXPECT_EQ(rolesIn({"error_mm", "session_id", "session_note"}),
            "error = error_mm; session = session_id; covariates: session_note");
  EXPECT_EQ(rolesIn({"error_mm", "run_time_s"}), "error = error_mm; covariates: run_time_s");
  EXPECT_EQ(rolesIn({"error_mm", "pose_x", "pose_y"}), "error = error_mm; covariates: pose_x, pose_y");
  EXPECT_EQ(rolesIn({"error_mm", "sensor", "t_s"}), "error = error_mm; covariates: sensor, t_s")
      << "a device is no session";
  EXPECT_THAT(rolesIn({"error_mm", "session_hall", "session_field"}),
              HasSubstr("which column names the session: session_hall, session_field?"));
}

TEST(Roles, OfAMapAreChecked) {
  TableMap map;
  map.measured = "depht";
  EXPECT_THAT(rolesIn({"depth", "t"}, map), HasSubstr("no column \"depht\" for `measured`"));
  map.measured = "depth", map.reference = "depth";
  EXPECT_THAT(rolesIn({"depth", "t"}, map), HasSubstr("\"depth\" has two roles, `measured` and `reference`"));
  map.reference = "", map.ignore = {"u"};
  EXPECT_THAT(rolesIn({"depth", "t"}, map), HasSubstr("no column \"u\" to ignore"));
  map.ignore = {"t"};
  EXPECT_EQ(rolesIn({"depth", "t"}, map),
            "error = depth (without a reference); covariates: none; left out: t");
}

Nature natureIn(const std::string& header) {
  const auto read = parseReadings(tableOf({"error_mm", header}), {}, "t.csv");
  return read ? read->covariates.at(0).nature : Nature::Number;
}

TEST(Natures, ComeFromWordsUnitsAndValues) {
  for (const char* time : {"time_s", "Zeit [s]", "timestamp", "heure", "t_ms"})
    EXPECT_EQ(natureIn(time), Nature::Time) << time;
  for (const char* plain : {"exposure_time_us", "temperature_c", "T [°C]", "supply_V", "time_of_flight_ns"})
    EXPECT_EQ(natureIn(plain), Nature::Number) << plain;
  for (const char* length : {"plate_mm", "distance", "Abstand [m]"})
    EXPECT_EQ(natureIn(length), Nature::Length) << length;
  for (const char* angle : {"incidence_deg", "Winkel", "phase_rad"})
    EXPECT_EQ(natureIn(angle), Nature::Angle) << angle;
  for (const char* index : {"column", "u", "pixel_row", "frame", "Spalte"})
    EXPECT_EQ(natureIn(index), Nature::Index) << index;
  for (const char* category : {"sensor", "day", "Kamera"})
    EXPECT_EQ(natureIn(category), Nature::Category) << category;
}

TEST(Natures, BringTheirUnits) {
  std::string text = "error_cm;plate_m;phase_rad;time_min\n";
  for (int i = 0; i < 40; ++i)
    text += fmt::format("{};{};{};{}\n", i % 3, 0.1 * (i % 7), 3.14159265358979 * (i % 2), i);
  const auto read = parseReadings(text, {}, "t.csv");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->unit, "mm");
  EXPECT_NEAR(read->error[1], 10.0, 1e-12);
  EXPECT_NEAR(read->covariates[0].values[1], 100.0, 1e-9);
  EXPECT_NEAR(read->covariates[1].values[1], 180.0, 1e-9);
  EXPECT_NEAR(read->covariates[2].values[1], 60.0, 1e-9);
  EXPECT_EQ(read->covariates[2].unit, "s");
}

TEST(Categories, KeepTheirNames) {
  std::string text = "error_mm,sensor,filter,remark\n";
  for (int i = 0; i < 40; ++i)
    text += fmt::format("{},tof{},{},remark {}\n", i % 3, i % 4, i % 2 == 0 ? "none" : "median", i);
  const auto read = parseReadings(text, {}, "t.csv");
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->covariates.size(), 2u);
  EXPECT_THAT(read->covariates[0].words, testing::ElementsAre("tof0", "tof1", "tof2", "tof3"));
  EXPECT_THAT(read->covariates[1].words, testing::ElementsAre("none", "median"));
  EXPECT_THAT(read->notes, testing::Contains(HasSubstr("\"remark\" holds 40 different texts")));
}

/// Beside sessions, what names ten runs in each names captures.
TEST(Categories, AFinerGroupNamesCaptures) {
  std::string text = "error_mm,time_s,session,run\n";
  for (int i = 0; i < 200; ++i) text += fmt::format("{},{},{},{}\n", i % 7, i, i / 50, i % 50 / 5);
  const auto read = parseReadings(text, {}, "t.csv");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->session_name, "session");
  EXPECT_EQ(read->capture_name, "run");
}

TEST(Header, MustNameEachColumnOnce) {
  const auto errorIn = [](const char* text) { return parseReadings(text, {}, "t.csv").error().message; };
  EXPECT_THAT(errorIn("a_mm,a_mm\n1,2\n2,1\n"), HasSubstr("two columns are called \"a_mm\": rename one"));
  EXPECT_THAT(errorIn("depth_mm,\n1,2\n2,7\n"), HasSubstr("column 2 has no header: name it"));
  EXPECT_THAT(errorIn("1,2\n2,7\n"), HasSubstr("no line above it names the columns"));
  EXPECT_THAT(errorIn("depth_mm\n1\n2\n"), HasSubstr("no comma, semicolon, tab or blank parts \"depth_mm\""));
}

}  // namespace
}  // namespace toftwin::table
