// SPDX-License-Identifier: Apache-2.0
// What GigE Vision's commands do, without sockets and sources.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "../../matches.h"
#include "daemon/facades/gige_vision/source_facts.h"
#include "gige_vision_commands.h"

namespace toftwin::daemon::gige_vision {
namespace {

using namespace test;
using std::chrono::milliseconds;

constexpr std::uint32_t kControl = 2, kExclusive = 1;

TEST(GigeVisionDevice, DoesNotAnswerWhatIsNoCommand) {
  Camera camera;
  Bytes good = commandOf(Command::kDiscovery, 1, {});
  EXPECT_EQ(camera.take(kOwner, good).answer.size(), 8U + 0xF8U);
  for (std::size_t size = 0; size < good.size(); ++size)
    EXPECT_TRUE(camera.take(kOwner, Bytes(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size)))
                    .answer.empty());
  good[0] = std::byte{0x43};
  EXPECT_TRUE(camera.take(kOwner, good).answer.empty());
  EXPECT_TRUE(camera.take(kOwner, commandOf(Command::kDiscovery, 0, {})).answer.empty());
  Bytes longer = commandOf(Command::kDiscovery, 1, {});
  longer[5] = std::byte{1};  // it says that one byte follows
  EXPECT_EQ(Camera::statusOf(camera.take(kOwner, longer).answer), Status::kInvalidHeader);
  EXPECT_EQ(Camera::statusOf(camera.take(kOwner, commandOf(0x1234, 1, {})).answer), Status::kNotImplemented);
}

// Both are options of GigE Vision; whoever reads what the camera has must be able to trust it.
TEST(GigeVisionDevice, DeclaresNeitherEventsNorActionsAndRefusesThem) {
  constexpr std::uint32_t kEvents = 1U << 3, kEventsWithData = 1U << 4, kActions = 1U << 6,
                          kUnconditionalActions = 1U << 20, kScheduledActions = 1U << 17;
  constexpr std::uint16_t kEvent = 0x00C0, kEventWithData = 0x00C2, kAction = 0x0100;
  constexpr std::uint32_t kMessagePort = 0x0B00, kActionGroupKey = 0x9800;
  Camera camera;
  EXPECT_EQ(camera.value(Item::ControlCapability) &
                (kEvents | kEventsWithData | kActions | kUnconditionalActions | kScheduledActions),
            0U);
  EXPECT_EQ(camera.value(Item::MessageChannels), 0U);
  EXPECT_EQ(camera.value(Item::ActionSignals), 0U);
  EXPECT_EQ(camera.value(Item::MessageCapability), 0U);
  EXPECT_EQ(camera.write(Item::ControlPrivilege, kControl), Status::kSuccess);
  for (const std::uint32_t address : {kMessagePort, kActionGroupKey})
    EXPECT_EQ(camera.write(address, 5000), Status::kInvalidAddress) << address;
  const Bytes keys = words({1, 1, 1});  // an action's device key, group key and group mask
  for (const std::uint16_t command : {kEvent, kEventWithData, kAction}) {
    EXPECT_EQ(Camera::statusOf(camera.take(kOwner, commandOf(command, 7, keys)).answer),
              Status::kNotImplemented);
    EXPECT_TRUE(camera.take(kOwner, commandOf(command, 8, keys, 0)).answer.empty()) << "none was asked for";
  }
}

TEST(GigeVisionDevice, IsSetByItsControllerAlone) {
  Camera camera;
  EXPECT_EQ(camera.write(Item::PacketDelay, 5), Status::kAccessDenied);  // nobody controls it
  EXPECT_EQ(camera.write(Item::ControlPrivilege, kControl), Status::kSuccess);
  EXPECT_EQ(camera.write(Item::PacketDelay, 5), Status::kSuccess);
  for (const Peer& other : {kOther, kFar}) {
    EXPECT_EQ(camera.write(Item::PacketDelay, 6, other), Status::kAccessDenied);
    EXPECT_EQ(camera.write(Item::ControlPrivilege, kControl, other), Status::kAccessDenied);
    EXPECT_EQ(camera.write(Item::ControlPrivilege, 0, other), Status::kAccessDenied);
    EXPECT_EQ(camera.read(rowOf(Item::PacketDelay).address, other), Status::kSuccess);
  }
  EXPECT_EQ(camera.value(Item::PacketDelay), 5U);
  EXPECT_EQ(camera.write(Item::ControlPrivilege, kExclusive), Status::kSuccess);
  EXPECT_EQ(camera.read(rowOf(Item::PacketDelay).address, kOther), Status::kAccessDenied);
  const std::uint32_t who = rowOf(Item::ControlPrivilege).address;
  EXPECT_EQ(camera.read(who, kOther), Status::kSuccess);
  for (const Bytes& more :
       {commandOf(Command::kReadRegister, 90, words({who, rowOf(Item::PacketDelay).address})),
        commandOf(Command::kReadMemory, 91, words({who, 536}))}) {
    EXPECT_EQ(Camera::statusOf(camera.take(kOther, more).answer), Status::kAccessDenied);
    EXPECT_EQ(Camera::statusOf(camera.take(kOwner, more).answer), Status::kSuccess);
  }
  EXPECT_EQ(camera.write(Item::ControlPrivilege, 0), Status::kSuccess);
  EXPECT_EQ(camera.write(Item::ControlPrivilege, kControl, kFar), Status::kSuccess);
}

TEST(GigeVisionDevice, SendsToItsControllersAddressAlone) {
  Camera camera;
  camera.write(Item::ControlPrivilege, kControl);
  EXPECT_EQ(camera.write(Item::Destination, kFar.address), Status::kAccessDenied);
  EXPECT_EQ(camera.write(Item::Destination, 0xE0000001), Status::kAccessDenied);  // multicast
  EXPECT_EQ(camera.write(Item::HostPort, 7000), Status::kSuccess);
  EXPECT_EQ(camera.device.stream().to, Peer{});  // address 0 is no address of this computer
  EXPECT_EQ(camera.write(Item::Destination, kOwner.address), Status::kSuccess);
  EXPECT_EQ(camera.device.stream().to, (Peer{kOwner.address, 7000}));
  camera.write(Item::ControlPrivilege, 0);
  EXPECT_EQ(camera.device.stream().to, Peer{});  // the next controller may have another address
}

TEST(GigeVisionDevice, IsFreeWhenItsControllerIsSilent) {
  Camera camera;
  camera.write(Item::ControlPrivilege, kControl);
  EXPECT_EQ(camera.write(Item::HeartbeatTimeout, 499), Status::kInvalidParameter);
  EXPECT_EQ(camera.write(Item::HeartbeatTimeout, 500), Status::kSuccess);
  EXPECT_EQ(camera.write(Item::AcquisitionStart, 1), Status::kSuccess);
  camera.now += milliseconds{499};
  EXPECT_FALSE(camera.device.expire(camera.now));
  camera.value(Item::ControlPrivilege);  // any command will do
  camera.now += milliseconds{499};
  camera.read(0, kOther);  // but another's does not
  EXPECT_FALSE(camera.device.expire(camera.now));
  EXPECT_TRUE(camera.device.isStreaming());
  camera.now += milliseconds{1};
  EXPECT_TRUE(camera.device.expire(camera.now));
  EXPECT_FALSE(camera.device.isStreaming());
  EXPECT_FALSE(camera.device.expire(camera.now));
  EXPECT_EQ(camera.write(Item::ControlPrivilege, kControl, kOther), Status::kSuccess);
}

TEST(GigeVisionDevice, RefusesAddressesThatAreNotThereUpToTheLast) {
  Camera camera;
  camera.write(Item::ControlPrivilege, kControl);
  for (const std::uint32_t address : {kBootstrapEnd, 0x8000U, 0xFFFF'FFFCU, 0xFFFF'FF00U, 0x00F0'0000U}) {
    EXPECT_EQ(camera.read(address), Status::kInvalidAddress) << address;
    EXPECT_EQ(camera.write(address, 1), Status::kInvalidAddress) << address;
    Bytes many = words({address});
    append(many, 536, 4);
    EXPECT_EQ(Camera::statusOf(camera.take(kOwner, commandOf(Command::kReadMemory, 9, many)).answer),
              Status::kInvalidAddress);
    Bytes much = words({address});
    much.resize(4 + 536);
    EXPECT_EQ(Camera::statusOf(camera.take(kOwner, commandOf(Command::kWriteMemory, 9, much)).answer),
              Status::kInvalidAddress);
  }
  EXPECT_EQ(camera.read(2), Status::kBadAlignment);
  EXPECT_EQ(camera.write(rowOf(Item::SensorWidth).address, 1), Status::kWriteProtect);
  EXPECT_EQ(camera.write(rowOf(Item::Version).address, 1), Status::kWriteProtect);
}

TEST(GigeVisionDevice, DoesWhatIsRepeatedForWantOfAnAnswerOnce) {
  Camera camera;
  SourceFacts facts = smallCamera();
  facts.is_triggered = true;
  camera.device.update(facts);
  camera.write(Item::ControlPrivilege, kControl);
  const Bytes trigger =
      commandOf(Command::kWriteRegister, 77, words({rowOf(Item::TriggerSoftware).address, 1}));
  const auto first = camera.take(kOwner, trigger);
  EXPECT_TRUE(first.is_trigger);
  EXPECT_EQ(Camera::statusOf(first.answer), Status::kSuccess);
  const auto early = camera.take(kOwner, trigger);  // the answer still waits
  EXPECT_FALSE(early.is_trigger);
  EXPECT_TRUE(early.answer.empty());
  camera.device.noteAnswer(trigger, first.answer);
  EXPECT_EQ(camera.write(Item::PacketDelay, 6, kOther), Status::kAccessDenied);  // changes nothing in that
  const auto again = camera.take(kOwner, trigger);
  EXPECT_EQ(again.answer, first.answer);
  EXPECT_FALSE(again.is_trigger);
  const auto next = camera.take(
      kOwner, commandOf(Command::kWriteRegister, 78, words({rowOf(Item::TriggerSoftware).address, 1})));
  EXPECT_TRUE(next.is_trigger);
}

TEST(GigeVisionDevice, TurnsNumbersIntoChangesOfTheSourceWithinItsBounds) {
  Camera camera;
  camera.write(Item::ControlPrivilege, kControl);
  EXPECT_EQ(camera.writeFloat(Item::ExposureTime, 700.0), Status::kSuccess);
  EXPECT_EQ(camera.last.changes, (SourceChanges{{"exposure_us", 700.0}}));
  for (const double wrong : {9.0, 5001.0, std::nan(""), HUGE_VAL}) {
    EXPECT_EQ(camera.writeFloat(Item::ExposureTime, wrong), Status::kInvalidParameter) << wrong;
    EXPECT_TRUE(camera.last.changes.empty());
  }
  // In two halves: the second makes it whole.
  const auto bits = std::bit_cast<std::uint64_t>(800.0);
  EXPECT_EQ(camera.write(rowOf(Item::ExposureTime).address, static_cast<std::uint32_t>(bits >> 32U)),
            Status::kSuccess);
  EXPECT_TRUE(camera.last.changes.empty());
  EXPECT_EQ(camera.write(Item::ControlPrivilege, kControl, kOther), Status::kAccessDenied);  // between them
  EXPECT_EQ(camera.write(rowOf(Item::ExposureTime).address + 4, static_cast<std::uint32_t>(bits)),
            Status::kSuccess);
  EXPECT_EQ(camera.last.changes, (SourceChanges{{"exposure_us", 800.0}}));
  EXPECT_EQ(camera.write(Item::TriggerMode, 1), Status::kSuccess);
  EXPECT_EQ(camera.last.changes, (SourceChanges{{"triggered", 1.0}}));
  SourceFacts fixed = smallCamera();
  fixed.exposure_us->parameter.clear();
  fixed.can_choose_trigger = false;
  camera.device.update(fixed);
  EXPECT_EQ(camera.writeFloat(Item::ExposureTime, 700.0), Status::kWriteProtect);
  EXPECT_EQ(camera.write(Item::TriggerMode, 1), Status::kWriteProtect);
}

TEST(GigeVisionDevice, KeepsRegionsInsideTheImageAndThePayloadsSizeTrue) {
  Camera camera;
  camera.write(Item::ControlPrivilege, kControl);
  EXPECT_EQ(camera.value(Item::PayloadSize), 16U * 12U * 2U);  // the first component alone
  EXPECT_EQ(camera.write(Item::ChannelConfiguration, 0x40), Status::kSuccess);
  EXPECT_EQ(camera.value(Item::PayloadSize), 16U * 12U * 6U);
  EXPECT_EQ(camera.write(Item::OffsetX, 1), Status::kInvalidParameter);
  EXPECT_EQ(camera.write(Item::Width, 10), Status::kSuccess);
  const double whole = camera.real(Item::PrincipalPointU);
  EXPECT_EQ(camera.write(Item::OffsetX, 6), Status::kSuccess);
  EXPECT_EQ(camera.real(Item::PrincipalPointU), whole - 6.0) << "SFNC: from the region's first pixel on";
  EXPECT_EQ(camera.write(Item::OffsetX, 7), Status::kInvalidParameter);
  EXPECT_EQ(camera.write(Item::Width, 11), Status::kInvalidParameter);
  EXPECT_EQ(camera.write(Item::Width, 0), Status::kInvalidParameter);
  EXPECT_EQ(camera.write(rowOf(Item::PixelFormat).address, Pixel::kAbc32f), Status::kSuccess);
  EXPECT_EQ(camera.value(Item::PayloadSize), 10U * 12U * (12U + 2U + 2U));
  EXPECT_EQ(camera.write(rowOf(Item::PixelFormat).address, Pixel::kMono16), Status::kInvalidParameter);
  EXPECT_EQ(camera.write(Item::AcquisitionStart, 1), Status::kSuccess);
  EXPECT_EQ(camera.write(Item::Width, 8), Status::kBusy);
  EXPECT_EQ(camera.write(Item::AcquisitionStop, 1), Status::kSuccess);
  EXPECT_EQ(camera.write(Item::Width, 8), Status::kSuccess);
  SourceFacts larger = smallCamera();
  larger.camera.width = 32;
  camera.device.update(larger);
  EXPECT_EQ(camera.value(Item::Width), 32U);
}

TEST(GigeVisionDevice, KeepsItsRegionWhileItsSourceIsAwayAndEndsTheStreamWhereTheSizeIsAnother) {
  Camera camera;
  camera.write(Item::ControlPrivilege, kControl);
  EXPECT_EQ(camera.write(Item::Width, 10), Status::kSuccess);
  EXPECT_EQ(camera.write(Item::OffsetX, 6), Status::kSuccess);
  EXPECT_EQ(camera.write(Item::AcquisitionStart, 1), Status::kSuccess);
  camera.device.update({});
  EXPECT_EQ(camera.value(Item::PayloadSize), 0U);
  camera.device.update(smallCamera());
  EXPECT_EQ(camera.value(Item::Width), 10U);
  EXPECT_EQ(camera.value(Item::OffsetX), 6U);
  EXPECT_TRUE(camera.device.isStreaming());
  SourceFacts larger = smallCamera();
  larger.camera.width = 32;
  camera.device.update({});
  camera.device.update(larger);
  EXPECT_EQ(camera.value(Item::Width), 32U);
  EXPECT_FALSE(camera.device.isStreaming());
}

TEST(GigeVisionDevice, KnowsTheTimeHoweverLateItsFramesCome) {
  using std::chrono::nanoseconds, std::chrono::system_clock;
  constexpr std::int64_t kSecond_ns = 1'000'000'000, kHostMinusDevice_ns = 900 * kSecond_ns;
  const auto host = [] { return nanoseconds{system_clock::now().time_since_epoch()}.count(); };
  const Result<wire::SourceDescription> away{Error{Error::Code::NotFound, "away"}};
  for (const bool is_known : {true, false}) {
    SourceWatch watch;
    Frame frame;
    const std::int64_t before = host(), start = before - kHostMinusDevice_ns - 3 * kSecond_ns;
    frame.moment.exposures = {{{start}, 1_ms, 20_MHz}};
    frame.moment.clock = {kHostMinusDevice_ns, is_known ? 1000 : -1};
    watch.note(frame);  // three seconds after its exposure began
    const std::int64_t device_now = watch.facts(away, false).now_ns,
                       host_now = watch.facts(away, true).now_ns;
    const std::int64_t after = host(), late = is_known ? 0 : 3 * kSecond_ns;
    EXPECT_GE(device_now, before - kHostMinusDevice_ns - late);
    EXPECT_LE(device_now, after - kHostMinusDevice_ns - late);
    EXPECT_GE(host_now, before - late);
    EXPECT_LE(host_now, after - late);
  }
}

TEST(GigeVisionDevice, TakesSizesOfPacketsThatTheXmlAllows) {
  Camera camera;
  camera.write(Item::ControlPrivilege, kControl);
  for (const std::uint32_t size : {576U, 1500U, 16'112U})
    EXPECT_EQ(camera.write(Item::PacketSize, size), Status::kSuccess) << size;
  for (const std::uint32_t size : {572U, 1501U, 1502U, 16'116U})
    EXPECT_EQ(camera.write(Item::PacketSize, size), Status::kInvalidParameter) << size;
}

TEST(GigeVisionDevice, SendsNoFrameWhereItsSourceHasNoneOfItsImages) {
  Frame frame;
  frame.camera = smallCamera().camera;
  frame.planes = {toPlane(PlaneKind::Range, Image<float>{16, 12, 2.5F})};
  const Rays rays = raysOf(frame.camera);
  Camera camera;
  camera.write(Item::ControlPrivilege, kControl);
  EXPECT_EQ(camera.write(Item::ChunkModeActive, 1), Status::kSuccess);
  EXPECT_EQ(camera.write(Item::AcquisitionStart, 1), Status::kSuccess);
  EXPECT_TRUE(payloadOf(frame, rays, camera.device.stream().images, 7).ok());
  SourceFacts bare = smallCamera();
  bare.has_range = bare.has_intensity = bare.has_confidence = false;
  for (const SourceFacts& facts : {bare, SourceFacts{}}) {
    camera.device.update(facts);
    const auto payload = payloadOf(frame, rays, camera.device.stream().images, 7);
    ASSERT_FALSE(payload.ok());
    EXPECT_EQ(payload.error().code, Error::Code::Unsupported);
  }
}

TEST(GigeVisionDevice, DescribesEveryRegisterThatItHasAndHasEveryOneThatItDescribes) {
  const std::string& xml = genicamXml();
  Camera camera;
  std::map<std::string, int> nodes;
  for (const auto& node : toftwin::test::matchesIn(xml, R"re(<(\w+) Name="([\w]+)")re")) {
    if (node[1] != "EnumEntry" && node[1] != "pVariable") ++nodes[node[2]];
  }
  for (const auto& [name, count] : nodes) EXPECT_EQ(count, 1) << name;
  const auto references =
      toftwin::test::matchesIn(xml, R"re(<p(?!Port|Variable)(\w+)(?: \w+="\w+")?>(\w+)</p)re");
  for (const auto& reference : references) EXPECT_EQ(nodes.count(reference[2]), 1U) << reference[0];
  EXPECT_GT(references.size(), 150U);
  const auto registers = toftwin::test::matchesIn(
      xml, R"re(<Address>0x(\w+)</Address>(?:<pIndex[^/]*</pIndex>)?<Length>(\d+)</Length>)re");
  for (const auto& one : registers) {
    Bytes ignored;
    EXPECT_TRUE(Memory{}.read(std::stoul(one[1], nullptr, 16), std::stoul(one[2]), ignored)) << one[0];
  }
  EXPECT_GT(registers.size(), 90U);
  // No two registers share a byte.
  std::uint64_t free = 0;
  std::map<std::uint32_t, const Row*> by_address;
  for (const Row& row : allRows()) by_address[row.address] = &row;
  EXPECT_EQ(by_address.size(), allRows().size());
  for (const auto& [at, row] : by_address) {
    EXPECT_GE(at, free) << row->name;
    free = at + row->bytes();
  }
}

TEST(GigeVisionDevice, HasItsRowsInTheOrderOfItsItems) {
  for (std::size_t i = 0; i < allRows().size(); ++i)
    EXPECT_EQ(static_cast<std::size_t>(allRows()[i].item), i) << allRows()[i].name;
  EXPECT_EQ(allRows().size(), static_cast<std::size_t>(Item::kCount));
}

}  // namespace
}  // namespace toftwin::daemon::gige_vision
