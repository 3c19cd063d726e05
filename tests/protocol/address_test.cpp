// SPDX-License-Identifier: Apache-2.0
#include "protocol/transport/address.h"

#include <gmock/gmock.h>

namespace toftwin::transport {
namespace {

TEST(Address, ReadsEveryForm) {
  EXPECT_EQ(*parseAddress("tcp:robot:1234", 1), Address(TcpAddress{"robot", 1234}));
  EXPECT_EQ(*parseAddress("robot:1234", 1), Address(TcpAddress{"robot", 1234}));
  EXPECT_EQ(*parseAddress("robot", 47800), Address(TcpAddress{"robot", 47800}));
  EXPECT_EQ(*parseAddress("[::1]:1234", 1), Address(TcpAddress{"::1", 1234}));
  EXPECT_EQ(*parseAddress("tcp:[::1]", 47800), Address(TcpAddress{"::1", 47800}));
  EXPECT_EQ(*parseAddress("unix:/run/t.sock", 1), Address(UnixAddress{"/run/t.sock"}));
}

TEST(Address, ComesBackFromItsText) {
  for (const char* text : {"tcp:robot:1234", "tcp:[::1]:1234", "unix:/run/t.sock"}) {
    EXPECT_EQ(toString(*parseAddress(text, 1)), text);
  }
}

TEST(Address, SaysWhatIsWrong) {
  const auto errorOf = [](std::string_view text) {
    const auto address = parseAddress(text, 1);
    return address ? "" : address.error().message;
  };
  using testing::HasSubstr;
  EXPECT_THAT(errorOf("robot:70000"), HasSubstr("not a number from 0 to 65535"));
  EXPECT_THAT(errorOf("robot:12x"), HasSubstr("not a number from 0 to 65535"));
  EXPECT_THAT(errorOf("robot:"), HasSubstr("not a number"));
  EXPECT_THAT(errorOf(":1234"), HasSubstr("host is missing"));
  EXPECT_THAT(errorOf("::1"), HasSubstr("in brackets"));
  EXPECT_THAT(errorOf("[::1"), HasSubstr("closing ]"));
  EXPECT_THAT(errorOf("unix:"), HasSubstr("path is missing"));
  EXPECT_THAT(errorOf("unix:/" + std::string(200, 'a')), HasSubstr("at most 107"));
}

}  // namespace
}  // namespace toftwin::transport
