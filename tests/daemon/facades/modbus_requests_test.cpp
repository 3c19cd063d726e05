// SPDX-License-Identifier: Apache-2.0
// Modbus messages byte by byte, without a socket, and which lost frames are no alarm.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "daemon/facades/modbus/excuses.h"
#include "daemon/facades/modbus/identification.h"
#include "daemon/facades/modbus/requests.h"

namespace toftwin::daemon::modbus {
namespace {

class ModbusRequests : public testing::Test {
 protected:
  /// The answer's function and what follows it.
  std::vector<int> ask(const std::vector<int>& function_and_data) {
    Bytes message;
    for (const int byte : {0, 9, 0, 0, 0, static_cast<int>(function_and_data.size()) + 1, 1})
      message.push_back(static_cast<std::byte>(byte));
    for (const int byte : function_and_data) message.push_back(static_cast<std::byte>(byte));
    const TakeWrite take = [&](const Write& write) {
      writes_.push_back(write);
      for (std::size_t i = 0; i < write.words.size(); ++i)
        registers_.write(write.memory, write.address + i, write.words[i]);
      return std::uint8_t{0};
    };
    std::vector<int> answered;
    for (const std::byte one : answer(message, registers_, take, identity_))
      answered.push_back(std::to_integer<int>(one));
    return {answered.begin() + 7, answered.end()};
  }
  Registers registers_;
  Identity identity_{.revision = "1.2", .application = "dock"};
  std::vector<Write> writes_;
};

TEST_F(ModbusRequests, OneRequestWritesAndThenReads) {
  // Reads two holding registers from 2 on, and writes 0x1234 to number 2, the heartbeat.
  EXPECT_EQ(ask({23, 0, 2, 0, 2, 0, 2, 0, 1, 2, 0x12, 0x34}), (std::vector<int>{23, 4, 0x12, 0x34, 0, 0}));
  ASSERT_EQ(writes_.size(), 1u);
  EXPECT_EQ(writes_[0].address, 2u);
}

TEST_F(ModbusRequests, WhatCannotBeReadIsNotWritten) {
  EXPECT_EQ(ask({23, 0, 64, 0, 1, 0, 2, 0, 1, 2, 0x12, 0x34}), (std::vector<int>{23 | 0x80, 2}))
      << "there are 64";
  EXPECT_EQ(ask({23, 0, 0, 0, 126, 0, 2, 0, 1, 2, 0x12, 0x34}), (std::vector<int>{23 | 0x80, 3}))
      << "125 are the most";
  EXPECT_TRUE(writes_.empty());
}

TEST_F(ModbusRequests, WhatCannotBeWrittenIsNotRead) {
  EXPECT_EQ(ask({23, 0, 0, 0, 1, 0, 50, 0, 1, 2, 0, 1}), (std::vector<int>{23 | 0x80, 2})) << "no row";
  EXPECT_EQ(ask({23, 0, 0, 0, 1, 0, 2, 0, 2, 2, 0, 1}), (std::vector<int>{23 | 0x80, 3}))
      << "two words of one";
  EXPECT_EQ(ask({23, 0, 0, 0, 1}), (std::vector<int>{23 | 0x80, 3}));
}

std::vector<int> object(int id, const std::string& text) {
  std::vector<int> bytes{id, static_cast<int>(text.size())};
  for (const char c : text) bytes.push_back(c);
  return bytes;
}

TEST_F(ModbusRequests, TheDeviceIdentifiesItselfByThreeTextsOrSeven) {
  std::vector<int> expected{43, 14, 1, 0x82, 0, 0, 3};
  for (const auto& one : {object(0, "toftwin"), object(1, "modbus"), object(2, "1.2")})
    expected.insert(expected.end(), one.begin(), one.end());
  EXPECT_EQ(ask({43, 14, 1, 0}), expected);
  const auto regular = ask({43, 14, 2, 0});
  EXPECT_EQ(regular.at(6), 7);
  const auto last = object(6, "dock");
  EXPECT_EQ(std::vector<int>(regular.end() - 6, regular.end()), last);
}

TEST_F(ModbusRequests, OneTextIsIdentifiedByItsNumber) {
  std::vector<int> expected{43, 14, 4, 0x82, 0, 0, 1};
  const auto revision = object(2, "1.2");
  expected.insert(expected.end(), revision.begin(), revision.end());
  EXPECT_EQ(ask({43, 14, 4, 2}), expected);
  EXPECT_EQ(ask({43, 14, 4, 7}), (std::vector<int>{43 | 0x80, 2}));
}

TEST_F(ModbusRequests, AnotherIdentificationIsRefused) {
  EXPECT_EQ(ask({43, 13, 1, 0}), (std::vector<int>{43 | 0x80, 1})) << "CANopen";
  EXPECT_EQ(ask({43, 14, 0, 0}), (std::vector<int>{43 | 0x80, 3}));
  EXPECT_EQ(ask({43, 14, 5, 0}), (std::vector<int>{43 | 0x80, 3}));
  EXPECT_EQ(ask({43, 14, 1}), (std::vector<int>{43 | 0x80, 3}));
  EXPECT_EQ(ask({43}), (std::vector<int>{43 | 0x80, 1}));
}

TEST_F(ModbusRequests, LongTextsFitIntoAMessage) {
  identity_.vendor = identity_.product_code = identity_.revision = identity_.vendor_url = identity_.product =
      identity_.model = identity_.application = std::string(300, 'n');
  EXPECT_LE(ask({43, 14, 3, 0}).size(), 253u);
}

// ---- excuses -------------------------------------------------------------------------------------

TEST(ModbusExcuses, WhatIsLostWhileSomethingIsSetDoesNotCount) {
  Excuses excuses;
  EXPECT_EQ(excuses.countOf(2), 2u);
  excuses.begin(2);
  EXPECT_EQ(excuses.countOf(5), 2u);
  excuses.takeFrame(5, true);
  excuses.takeFrame(5, false);  // made before
  excuses.takeFrame(6, false);
  EXPECT_EQ(excuses.countOf(6), 2u);
  EXPECT_EQ(excuses.countOf(7), 3u) << "that was lost afterwards";
}

TEST(ModbusExcuses, OneThingAfterAnotherIsExcusedTogether) {
  Excuses excuses;
  excuses.begin(0);
  excuses.takeFrame(3, false);
  excuses.begin(3);
  excuses.takeFrame(4, false);
  excuses.takeFrame(4, false);
  EXPECT_EQ(excuses.countOf(4), 0u);
}

}  // namespace
}  // namespace toftwin::daemon::modbus
