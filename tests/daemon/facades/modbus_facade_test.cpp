// SPDX-License-Identifier: Apache-2.0
// The Modbus facade in a running daemon; its clients are libmodbus and our own rig's bus, as they are.
#include <gtest/gtest.h>
#include <modbus/modbus.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <optional>
#include <set>
#include <thread>

#include "daemon/facades/modbus/registers.h"
#include "drivers/rig/bus.h"
#include "facade_testing.h"

namespace toftwin::daemon {
namespace {

using namespace std::chrono_literals;
using namespace test;
using modbus::Item;
using modbus::Memory;

const modbus::Row& rowOf(Item item) { return modbus::registerMap()[static_cast<std::size_t>(item)]; }

/// libmodbus, by the names of the map.
class Plc {
 public:
  explicit Plc(std::uint16_t port) : line_(modbus_new_tcp("127.0.0.1", port)) {
    modbus_set_response_timeout(line_, 10, 0);
    EXPECT_EQ(modbus_connect(line_), 0) << modbus_strerror(errno);
  }
  ~Plc() {
    modbus_close(line_);
    modbus_free(line_);
  }
  Plc(const Plc&) = delete;
  Plc& operator=(const Plc&) = delete;

  bool bit(Item item) {
    std::uint8_t value = 9;
    const int at = rowOf(item).address;
    EXPECT_EQ(rowOf(item).memory == Memory::Coil ? modbus_read_bits(line_, at, 1, &value)
                                                 : modbus_read_input_bits(line_, at, 1, &value),
              1);
    return value != 0;
  }
  double number(Item item) {
    const modbus::Row& row = rowOf(item);
    std::uint16_t words[2] = {};
    const int count = modbus::wordsOf(row.kind);
    EXPECT_EQ(row.memory == Memory::Holding ? modbus_read_registers(line_, row.address, count, words)
                                            : modbus_read_input_registers(line_, row.address, count, words),
              count);
    switch (row.kind) {
      case modbus::NumberKind::F32:
        return static_cast<double>(modbus_get_float_abcd(words));
      case modbus::NumberKind::U32:
        return words[0] * 65'536.0 + words[1];
      case modbus::NumberKind::S16:
        return static_cast<std::int16_t>(words[0]);
      default:
        return words[0];
    }
  }
  /// 0, or the exception.
  int setBit(Item item, bool value) {
    return outcome(modbus_write_bit(line_, rowOf(item).address, value ? 1 : 0));
  }
  int setWord(Item item, std::uint16_t value) {
    return outcome(modbus_write_register(line_, rowOf(item).address, value));
  }
  void setFloat(Item item, float value) {
    const auto bits = std::bit_cast<std::uint32_t>(value);  // libmodbus 3.1.6's own function swaps bytes
    const std::uint16_t words[] = {static_cast<std::uint16_t>(bits >> 16), static_cast<std::uint16_t>(bits)};
    EXPECT_EQ(modbus_write_registers(line_, rowOf(item).address, 2, words), 2);
  }
  modbus_t* line() { return line_; }

 private:
  static int outcome(int result) { return result == -1 ? errno - MODBUS_ENOBASE : 0; }
  modbus_t* line_;
};

class ModbusFacade : public RunningFacade {
 protected:
  void startModbus(const std::string& source_keys, const std::string& facade_keys = {}) {
    port_ = freePort();
    start(fmt::format(
        "[[source]]\nname = 'cam'\n{}\n[[facade]]\nkind = 'modbus'\nsource = 'cam'\nport = {}\n{}\n",
        source_keys, port_, facade_keys));
  }
  std::uint16_t port_ = 0;
};

TEST(ModbusRegisters, OfTheMapDoNotOverlapAndStandInTheOrderOfTheirItems) {
  std::set<std::pair<Memory, int>> taken;
  int index = 0;
  for (const modbus::Row& row : modbus::registerMap()) {
    EXPECT_EQ(static_cast<int>(row.item), index++) << row.name;
    for (int i = 0; i < modbus::wordsOf(row.kind); ++i) {
      EXPECT_TRUE(taken.insert({row.memory, row.address + i}).second) << row.name;
    }
  }
}

TEST_F(ModbusFacade, TellsOfTheSourceAndItsFrames) {
  startModbus(kSmallSim + "powered_on_before_s = 156\n");
  EXPECT_EQ(facadeClients(), 0u);
  Plc plc{port_};
  EXPECT_TRUE(eventually([&] { return plc.number(Item::FrameAge) < 1e6; }));
  EXPECT_EQ(facadeClients(), 1u);
  auto native = client();
  auto stream = native.subscribe("cam");
  ASSERT_TRUE(stream.ok());
  const auto frame = stream->next(kSoon);
  ASSERT_TRUE(frame.ok());
  EXPECT_TRUE(plc.bit(Item::Present));
  EXPECT_TRUE(plc.bit(Item::Streaming));
  EXPECT_FALSE(plc.bit(Item::CanTrigger));
  // A slow machine may lose frames, which is an alarm of its own.
  for (const Item alarm :
       {Item::AlarmLost, Item::AlarmTemperature, Item::AlarmCommand, Item::AlarmFewValid}) {
    EXPECT_FALSE(plc.bit(alarm)) << plc.number(Item::Alarms);
  }
  EXPECT_EQ(plc.number(Item::MapVersion), 1.0);
  EXPECT_NEAR(plc.number(Item::TemperatureIllumination) / 10.0, 28.6, 0.5) << "2.6 minutes after power-on";
  EXPECT_EQ(plc.number(Item::TemperatureHousing), -32'768.0) << "not known";
  // The wall is there in every frame; noise of single frames is below a centimetre here.
  const auto range = frame->find(PlaneKind::Range)->as<float>();
  const auto centre =
      static_cast<std::size_t>(frame->camera.height / 2 * frame->camera.width + frame->camera.width / 2);
  EXPECT_NEAR(plc.number(Item::CentreRange), static_cast<double>(range[centre]), 0.1);
  const auto valid = std::count_if(range.begin(), range.end(), [](float one) { return std::isfinite(one); });
  EXPECT_NEAR(plc.number(Item::Valid),
              1000.0 * static_cast<double>(valid) / static_cast<double>(range.size()), 10.0);
  const double before = plc.number(Item::Frames);
  EXPECT_TRUE(eventually([&] { return plc.number(Item::Frames) > before; }));
}

TEST_F(ModbusFacade, ATriggerTakesOneFrameAndTheCoilSaysWhenItIsThere) {
  startModbus(kSmallSim + "pace = 'trigger'\n");
  Plc plc{port_};
  EXPECT_TRUE(plc.bit(Item::CanTrigger));
  for (int i = 1; i <= 3; ++i) {
    EXPECT_EQ(plc.setBit(Item::Trigger, true), 0);
    EXPECT_TRUE(eventually([&] { return !plc.bit(Item::Trigger); }));
    EXPECT_EQ(plc.number(Item::Frames), static_cast<double>(i));
    EXPECT_EQ(plc.number(Item::CommandResult), 0.0);
  }
}

TEST_F(ModbusFacade, ATriggerInFreeRunIsAnAlarmUntilItIsAcknowledged) {
  startModbus(kPattern);
  Plc plc{port_};
  EXPECT_EQ(plc.setBit(Item::Trigger, true), 0);
  EXPECT_TRUE(eventually([&] { return plc.bit(Item::AlarmCommand); }));
  EXPECT_TRUE(plc.bit(Item::AnyAlarm));
  EXPECT_EQ(plc.number(Item::CommandResult), 1.0 + static_cast<double>(Error::Code::Unsupported));
  EXPECT_EQ(plc.setBit(Item::Acknowledge, true), 0);
  EXPECT_FALSE(plc.bit(Item::AlarmCommand));
}

TEST_F(ModbusFacade, RecipesAndPosesAreSelectedByNumber) {
  startModbus(kSmallSim,
              "[[facade.recipe]]\nname = 'near'\nset = ['exposure_us = 300', 'frame_rate_hz = 10']\n"
              "[[facade.recipe]]\nname = 'wrong'\nset = ['no_such = 1']\n"
              "[[facade.pose]]\nname = 'aside'\nposition_m = [0.25, 0.0, -0.5]\n");
  Plc plc{port_};
  EXPECT_EQ(plc.setWord(Item::Recipe, 1), 0);
  EXPECT_TRUE(eventually([&] { return plc.number(Item::Recipe) == 1.0; }));
  const auto now = client().describe("cam");
  EXPECT_NEAR(now->parameters.at(0).value.value_or(0.0), 300.0, 1e-6);
  EXPECT_NEAR(now->frame_interval->in(millisecond), 100.0, 1e-6);
  EXPECT_EQ(plc.setWord(Item::Recipe, 3), 3) << "there is none: illegal data value";
  EXPECT_EQ(plc.setWord(Item::Recipe, 2), 0);
  EXPECT_TRUE(eventually([&] { return plc.bit(Item::AlarmCommand); }));
  EXPECT_EQ(plc.number(Item::Recipe), 1.0) << "the last that worked";
  EXPECT_EQ(plc.setWord(Item::Pose, 1), 0);
  EXPECT_TRUE(eventually([&] { return plc.number(Item::Pose) == 1.0; }));
  EXPECT_NEAR(client().describe("cam")->world_from_camera->translation_m.z, -0.5, 1e-9);
}

TEST_F(ModbusFacade, APoseOfNumbersMovesTheCamera) {
  startModbus(kSmallSim);
  Plc plc{port_};
  plc.setFloat(Item::PoseX, 0.5F);
  plc.setFloat(Item::PoseRz, 90.0F);
  EXPECT_EQ(plc.setBit(Item::ApplyPose, true), 0);
  EXPECT_TRUE(eventually([&] { return !plc.bit(Item::ApplyPose); }));
  const auto pose = client().describe("cam")->world_from_camera;
  EXPECT_NEAR(pose->translation_m.x, 0.5, 1e-9);
  EXPECT_NEAR(std::abs(pose->rotation_wxyz[3]), std::sqrt(0.5), 1e-7) << "a quarter turn about z";
}

TEST_F(ModbusFacade, WhatIsNotInTheMapIsRefused) {
  startModbus(kPattern);
  Plc plc{port_};
  std::uint16_t words[200] = {};
  errno = 0;
  EXPECT_EQ(modbus_read_input_registers(plc.line(), 10'000, 1, words), -1);
  EXPECT_EQ(errno, EMBXILADD);
  EXPECT_EQ(modbus_write_register(plc.line(), 5, 1), -1) << "a gap";
  EXPECT_EQ(errno, EMBXILADD);
  EXPECT_EQ(modbus_report_slave_id(plc.line(), 8, reinterpret_cast<std::uint8_t*>(words)), -1);
  EXPECT_EQ(errno, EMBXILFUN);
  EXPECT_EQ(modbus_read_input_registers(plc.line(), 0, 38, words), 38) << "the whole map at once";
  EXPECT_EQ(modbus_read_input_registers(plc.line(), 127, 2, words), -1) << "beyond the end";
}

/// As PLCs do: whole bytes of bits, and blocks of registers.
TEST_F(ModbusFacade, BlocksThatReachBeyondTheRowsAreReadAndPaddedWithZeros) {
  startModbus(kPattern);
  Plc plc{port_};
  std::uint8_t bits[16] = {};
  std::uint16_t words[125] = {};
  std::ranges::fill(bits, std::uint8_t{9});
  std::ranges::fill(words, std::uint16_t{9});
  EXPECT_EQ(modbus_read_input_bits(plc.line(), 0, 16, bits), 16);
  EXPECT_EQ(bits[15], 0);
  EXPECT_EQ(modbus_read_bits(plc.line(), 0, 8, bits), 8);
  EXPECT_EQ(bits[7], 0);
  EXPECT_EQ(modbus_read_registers(plc.line(), 0, 64, words), 64);
  EXPECT_EQ(words[63], 0);
  EXPECT_EQ(modbus_read_input_registers(plc.line(), 0, 125, words), 125);
  EXPECT_EQ(words[40], 0);
  EXPECT_EQ(modbus_write_register(plc.line(), 40, 1), -1) << "of no row";
  EXPECT_EQ(errno, EMBXILADD);
}

TEST_F(ModbusFacade, AStalledClientHoldsUpNobody) {
  startModbus(kPattern);
  Plc stalled{port_}, lively{port_};
  const std::uint8_t half[] = {0, 1, 0};
  ASSERT_EQ(::send(modbus_get_socket(stalled.line()), half, sizeof half, 0), 3);
  for (int i = 0; i < 200; ++i) ASSERT_EQ(lively.number(Item::MapVersion), 1.0);
}

TEST_F(ModbusFacade, ALineThatIsCutOnPurposeSaysEachTimeInItsLog) {
  startModbus(kPattern, "[facade.line]\ndisconnect = 0.3\nseed = 4\nlog = 'line.csv'\n");
  int cut = 0;
  std::optional<Plc> plc{port_};
  for (int i = 0; i < 60; ++i) {
    std::uint16_t word = 0;
    if (modbus_read_input_registers(plc->line(), 0, 1, &word) == 1) continue;
    ++cut;
    plc.emplace(port_);
  }
  std::ifstream log{folder_ / "line.csv"};
  std::vector<std::string> lines;
  for (std::string line; std::getline(log, line);) lines.push_back(line);
  ASSERT_FALSE(lines.empty());
  EXPECT_EQ(lines.front(), "packet,kind,what");
  EXPECT_EQ(static_cast<int>(lines.size()) - 1, cut);
  // 60 answers at 0.3 are 18 with a deviation of 3.5; the seed makes it the same number each time.
  EXPECT_NEAR(cut, 18, 14);
  EXPECT_NE(lines.at(1).find(",disconnect,answer"), std::string::npos) << lines.at(1);
}

TEST_F(ModbusFacade, AnAnswerThatIsLostIsTheOnlyOne) {
  startModbus(kPattern, "[facade.line]\nloss = 1.0\n");
  Plc plc{port_};
  modbus_set_response_timeout(plc.line(), 0, 50'000);
  std::uint16_t word = 0;
  errno = 0;
  EXPECT_EQ(modbus_read_input_registers(plc.line(), 0, 1, &word), -1);
  EXPECT_EQ(errno, ETIMEDOUT);
}

TEST_F(ModbusFacade, OurOwnRigsBusReadsAndSetsIt) {
  startModbus(kSmallSim);
  rig::RigFile file;
  file.host = "127.0.0.1";
  file.port = port_;
  auto bus = rig::Bus::open(file);
  ASSERT_TRUE(bus.ok()) << bus.error().message;
  rig::Signal present;
  present.memory = rig::Memory::Discrete;
  present.address = rowOf(Item::Present).address;
  EXPECT_TRUE(*(*bus)->isSet(present, "present"));
  rig::Signal x;
  x.memory = rig::Memory::Holding;
  x.address = rowOf(Item::PoseX).address;
  x.number = rig::NumberKind::F32;
  ASSERT_TRUE((*bus)->write(x, 1.25, "pose_x").ok());
  EXPECT_EQ(*(*bus)->read(x, "pose_x"), 1.25);
  rig::Signal apply;
  apply.memory = rig::Memory::Coil;
  apply.address = rowOf(Item::ApplyPose).address;
  ASSERT_TRUE((*bus)->set(apply, true, "apply_pose").ok());
  EXPECT_TRUE(eventually([&] { return !*(*bus)->isSet(apply, "apply_pose"); }));
  EXPECT_NEAR(client().describe("cam")->world_from_camera->translation_m.x, 1.25, 1e-9);
}

}  // namespace
}  // namespace toftwin::daemon
