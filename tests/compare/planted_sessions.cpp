// SPDX-License-Identifier: Apache-2.0
// Tables whose rows are of several sessions, each with an offset of its own, that a column tells.
#include <cmath>
#include <numbers>
#include <utility>

#include "planted.h"

namespace toftwin::compare {
namespace {

/// Three sessions, each off by 2 mm of its own, that a column tells: in turn, or one after the other.
std::vector<Planted> ofSessions() {
  const auto add = [](Columns& error, const Columns& session, Noise& noise) {
    const Columns offset{noise(2.0), noise(2.0), noise(2.0)};
    for (std::size_t i = 0; i < error.size(); ++i) error[i] += offset[static_cast<std::size_t>(session[i])];
  };
  std::vector<Planted> rows;
  rows.push_back({"harmonics, three sessions in turn",
                  {{"30 MHz, 4 per period", 6.0}, {"offset", 3.0}, {"scale", 0.0}},
                  [=](Noise& noise) {
                    constexpr double kWave = 4.0 * std::numbers::pi * 30e6 / 299'792'458.0;
                    const Columns d = evenly(0.5, 6.5, 240);
                    Columns session, error = alike(d, 1.0, 0.0, noise, [](double x) {
                                       return 3.0 + 6.0 * std::cos(4.0 * kWave * x + 0.7);
                                     });
                    for (std::size_t i = 0; i < d.size(); ++i) session.push_back(static_cast<double>(i % 3));
                    add(error, session, noise);
                    return harmonicTraits(d, error, std::vector{30e6}, std::vector{4}, {.session = session});
                  }});
  rows.push_back({"harmonics, eight sessions of six rows",
                  {{"30 MHz, 4 per period", 6.0}, {"offset", 3.0}, {"scale", 0.0}, {"residual", 1.0}},
                  [](Noise& noise) {
                    constexpr double kWave = 4.0 * std::numbers::pi * 30e6 / 299'792'458.0;
                    const Columns d = evenly(0.5, 6.5, 48);
                    Columns session, offset, error;
                    for (int i = 0; i < 8; ++i) offset.push_back(noise(2.0));
                    for (std::size_t i = 0; i < d.size(); ++i) {
                      session.push_back(static_cast<double>(i % 8));
                      error.push_back(3.0 + offset[i % 8] + 6.0 * std::cos(4.0 * kWave * d[i] + 0.7) + noise(1.0));
                    }
                    return harmonicTraits(d, error, std::vector{30e6}, std::vector{4}, {.session = session});
                  }});
  rows.push_back({"corner, three sessions one after the other",
                  {{"at the edge", 40.0}, {"reach", 0.25}, {"far from it", -3.0}},
                  [=](Noise& noise) {
                    const Columns x = evenly(0.0, 1.2, 150);
                    Columns session,
                        error = alike(x, 1.0, 0.0, noise, [](double d) { return -3.0 + 40.0 * std::exp(-d / 0.25); });
                    for (std::size_t i = 0; i < x.size(); ++i) session.push_back(static_cast<double>(i / 50));
                    add(error, session, noise);
                    return cornerTraits(x, error, session);
                  }});
  rows.push_back({"ambient, two sessions one after the other", {{"bias", 0.12}}, [=](Noise& noise) {
                    const Columns klx = evenly(0.0, 60.0, 60);
                    Columns session, sigma(60, 10.0),
                        error = alike(klx, 1.0, 0.0, noise, [](double e) { return 2.0 + 0.12 * e; });
                    for (std::size_t i = 0; i < klx.size(); ++i) session.push_back(static_cast<double>(i / 30));
                    add(error, session, noise);
                    return ambientTraits(klx, error, sigma, session);
                  }});
  rows.push_back({"amplitude, two sessions in turn", {{"at 1", 12.0}, {"per decade", -4.0}}, [=](Noise& noise) {
                    const Columns decades = evenly(1.0, 4.0, 100);
                    Columns session, amplitude,
                        error = alike(decades, 1.0, 0.0, noise, [](double a) { return 12.0 - 4.0 * a; });
                    for (std::size_t i = 0; i < decades.size(); ++i)
                      session.push_back(static_cast<double>(i % 2)), amplitude.push_back(std::pow(10.0, decades[i]));
                    add(error, session, noise);
                    return amplitudeTraits(amplitude, error, {}, session);
                  }});
  return rows;
}

/// What is off at a place is off in all sessions, or in each anew.
AtPlaceOfSession repeatedInSessions(const Columns& places, int sessions, int count, bool in_each, Noise& noise,
                                    const std::function<double(double)>& f) {
  AtPlaceOfSession rows;
  Columns offset, off;
  for (int s = 0; s < sessions; ++s) offset.push_back(noise(2.0));
  for (const double place : places) {
    for (int s = 0; s < sessions; ++s) {
      if (s == 0 || in_each) off.push_back(noise(1.0));
      for (int i = 0; i < count; ++i) {
        rows.x.push_back(place), rows.session.push_back(s);
        rows.y.push_back(f(place) + offset[static_cast<std::size_t>(s)] + off.back() + noise(0.5));
      }
    }
  }
  return rows;
}

std::vector<Planted> ofSessionsAtPlaces() {
  std::vector<Planted> rows;
  rows.push_back({"amplitude, six readings of each of five in both of two sessions",
                  {{"at 1", 12.0}, {"per decade", -4.0}},
                  [](Noise& noise) {
                    const auto at = repeatedInSessions({100, 200, 400, 800, 1600}, 2, 6, false, noise,
                                                       [](double a) { return 12.0 - 4.0 * std::log10(a); });
                    return amplitudeTraits(at.x, at.y, {}, at.session);
                  }});
  rows.push_back({"motion, four readings of each of six speeds in each of four sessions",
                  {{"per speed", 7.5}},
                  [](Noise& noise) {
                    const auto at = repeatedInSessions(evenly(0.2, 1.2, 6), 4, 4, true, noise,
                                                       [](double v) { return 1.0 + 7.5 * v; });
                    return motionTraits(at.x, at.y, at.session);
                  }});
  rows.push_back({"ambient, five readings of each of six in both of two sessions", {{"bias", 0.12}}, [](Noise& noise) {
                    const auto at = repeatedInSessions(evenly(0.0, 60.0, 6), 2, 5, false, noise,
                                                       [](double e) { return 2.0 + 0.12 * e; });
                    return ambientTraits(at.x, at.y, Columns(at.x.size(), 10.0), at.session);
                  }});
  rows.push_back({"corner, two readings of each of 30 in each of three sessions",
                  {{"at the edge", 40.0}, {"reach", 0.25}, {"far from it", -3.0}},
                  [](Noise& noise) {
                    const auto at = repeatedInSessions(evenly(0.0, 1.2, 30), 3, 2, false, noise,
                                                       [](double d) { return -3.0 + 40.0 * std::exp(-d / 0.25); });
                    return cornerTraits(at.x, at.y, at.session);
                  }});
  rows.push_back({"harmonics, two readings of each of 25 in each of three sessions",
                  {{"30 MHz, 4 per period", 6.0}, {"offset", 3.0}, {"scale", 0.0}, {"residual", std::sqrt(1.25)}},
                  [](Noise& noise) {
                    constexpr double kWave = 4.0 * std::numbers::pi * 30e6 / 299'792'458.0;
                    const auto at = repeatedInSessions(evenly(0.5, 5.0, 25), 3, 2, false, noise, [](double d) {
                      return 3.0 + 6.0 * std::cos(4.0 * kWave * d + 0.7);
                    });
                    return harmonicTraits(at.x, at.y, std::vector{30e6}, std::vector{4, 2}, {.session = at.session});
                  }});
  return rows;
}

}  // namespace

std::vector<Planted> plantedSessions() {
  std::vector<Planted> all = ofSessions();
  for (Planted& one : ofSessionsAtPlaces()) all.push_back(std::move(one));
  return all;
}

}  // namespace toftwin::compare
