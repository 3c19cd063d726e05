// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>

namespace toftwin::test {

/// A motion controller with two axes, x (mm) and turn (deg), as a Modbus TCP server on loopback.
/// Axes accelerate and brake; between motor and load there is backlash; the encoder is at the
/// motor. Runs on one thread of its own; every member may be called from any other.
///
///   coils      0 stop   1 go   2 home   3 captured
///   discrete   0 emergency loop is closed   1 fault   2 homed   3 in position   4 trigger
///   holding    0 x target (f32)   2 turn target (s32, 1/1000 deg, low word first)   10 heartbeat
///   input      0 x position       2 turn position       20 room temperature (s16, 1/10 °C)   21
///   fault code
class EmulatedRig {
 public:
  struct Options {
    double speed = 400.0, acceleration = 4000.0;  ///< mm/s, mm/s², and the same in degrees
    double backlash = 0.0;                        ///< mm or degrees, in all
    bool is_homed = true;
    double stop_without_heartbeat_s = 0.0;  ///< 0: it goes on
  };
  EmulatedRig() : EmulatedRig(Options{}) {}
  explicit EmulatedRig(Options options);
  ~EmulatedRig();

  /// A rig file for it, with short times; `more` is put before its tables.
  [[nodiscard]] std::string file(const std::string& more = {}) const;
  [[nodiscard]] std::filesystem::path writeFile(const std::string& more = {}) const;

  /// Where the load is: what a camera on it sees.
  [[nodiscard]] double load(int axis);
  [[nodiscard]] bool isMoving();
  [[nodiscard]] bool isStopped();
  [[nodiscard]] bool isHoming();  ///< told to, and not yet otherwise
  /// How often motion began.
  [[nodiscard]] int departures();
  [[nodiscard]] bool isCaptured();
  void leaveCaptured();  ///< set, as after an earlier capture

  // What goes wrong, when the axis x has come past that place on its way up.
  void stallAt(double x);
  void dropLineAt(double x, bool for_ever);
  void refuseAt(double x);  ///< every request but a stop is answered with exception 4
  void fallSilentAt(double x);
  void pressEmergencyAt(double x);
  void failAt(double x, int code);

  void pressEmergency(bool is_pressed);
  void setTrigger(bool is_set);
  void setTemperature(double celsius);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace toftwin::test
