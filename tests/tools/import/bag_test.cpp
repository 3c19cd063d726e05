// SPDX-License-Identifier: Apache-2.0
// Bags that were written here, by the formats' own rules, and read back.
#include <bzlib.h>
#include <lz4frame.h>
#include <sqlite3.h>

#include <random>

#include "protocol/record/mcap_writer.h"
#include "sim/pictures/png.h"
#include "tests/tools/import/bag_testing.h"
#include "tools/cli/import/bag/images.h"
#include "tools/cli/import/bag/topic_role.h"
#include "tools/cli/import/bag/transforms.h"

namespace toftwin::cli {
namespace {

using record::Folder;
using testing::Contains;
using testing::HasSubstr;

class RoundTrip : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Formats, RoundTrip, testing::Values("ros2", "foxglove"), [](const auto& one) { return std::string{one.param}; });

TEST_P(RoundTrip, EveryPlanePoseLensAndTimeComesBackBitForBit) {
  const Folder folder;
  writeFrames(folder / "bag.mcap", GetParam(), 5);
  const auto frames = framesIn(folder / "bag.mcap");
  ASSERT_EQ(frames.size(), 5u);
  for (std::size_t i = 0; i < frames.size(); ++i) expectAll(frames[i], frameOfAll(i));
}

TEST_P(RoundTrip, DamagedFilesGiveWhatIsWholeAndNoCrash) {
  const Folder folder;
  writeFrames(folder / "bag.mcap", GetParam(), 3);
  const auto whole = record::bytesOf(folder / "bag.mcap");
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE(seed);
  std::mt19937 random{seed};
  for (int i = 0; i < 60; ++i) {
    auto bytes = whole;
    for (int flips = 0; flips < 4; ++flips) bytes[random() % bytes.size()] = static_cast<std::byte>(random());
    if (i % 4 == 0) bytes.resize(random() % bytes.size());
    record::writeBytes(folder / "damaged.mcap", bytes);
    auto source = openImport(folder / "damaged.mcap", {});
    std::size_t frames = 0;
    while (source && (*source)->next()) ++frames;
    EXPECT_LE(frames, 3u);
  }
}

/// A bag of ROS 2 in SQLite, as rosbag2 makes it.
void writeDb3(const std::filesystem::path& file, std::uint32_t first_ns = 0) {
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(file.c_str(), &database), SQLITE_OK);
  sqlite3_exec(database,
               "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL, "
               "offered_qos_profiles TEXT NOT NULL);"
               "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);"
               "INSERT INTO topics VALUES(1, '/cam/depth/image_raw', 'sensor_msgs/msg/Image', 'cdr', ''),"
               "(2, '/cam/depth/camera_info', 'sensor_msgs/msg/CameraInfo', 'cdr', ''), (3, '/rosout', 'rcl_interfaces/msg/Log', 'cdr', '')",
               nullptr, nullptr, nullptr);
  const auto insert = [&](int topic, std::int64_t time_ns, const std::vector<std::byte>& bytes) {
    sqlite3_stmt* row = nullptr;
    sqlite3_prepare_v2(database, "INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)", -1, &row, nullptr);
    sqlite3_bind_int(row, 1, topic);
    sqlite3_bind_int64(row, 2, time_ns);
    sqlite3_bind_blob(row, 3, bytes.data(), static_cast<int>(bytes.size()), SQLITE_TRANSIENT);
    EXPECT_EQ(sqlite3_step(row), SQLITE_DONE);
    sqlite3_finalize(row);
  };
  insert(2, 5, ros::toCdr(infoForBag()));
  for (std::uint32_t i = 0; i < 4; ++i) insert(1, 10 + i, ros::toCdr(depthForBag(first_ns + i)));
  insert(3, 12, {std::byte{1}});
  sqlite3_close(database);
}

TEST(Db3, FramesOfABagInSqliteComeInTheOrderOfTheirTimes) {
  const Folder folder;
  writeDb3(folder / "bag.db3");
  std::vector<std::string> notes;
  expectDepthForBag(framesIn(folder / "bag.db3", {}, &notes), 4);
  EXPECT_THAT(notes, Contains(HasSubstr("1 mm")));
}

TEST(Db3, StampsThatStandStillMakeAFrameOfEachImage) {
  const Folder folder;
  std::filesystem::create_directory(folder / "bag");
  writeDb3(folder / "bag/a.db3");
  writeDb3(folder / "bag/b.db3");  // the same stamps once more
  expectDepthForBag(framesIn(folder / "bag"), 8);
}

TEST(Db3, AnotherDatabaseIsNoBag) {
  const Folder folder;
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open((folder / "other.db3").c_str(), &database), SQLITE_OK);
  sqlite3_exec(database, "CREATE TABLE people(name TEXT)", nullptr, nullptr, nullptr);
  sqlite3_close(database);
  const auto source = openImport(folder / "other.db3", {});
  ASSERT_FALSE(source);
  EXPECT_THAT(source.error().message, HasSubstr("no bag of ROS 2"));
}

TEST(Db3, AViewInPlaceOfATableIsNotRun) {
  const Folder folder;
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open((folder / "view.db3").c_str(), &database), SQLITE_OK);
  sqlite3_exec(database,
               "CREATE TABLE topics(id INTEGER, name TEXT, type TEXT, serialization_format TEXT);"
               "CREATE VIEW messages AS WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM n) SELECT x AS topic_id, x AS timestamp, x AS data FROM n",
               nullptr, nullptr, nullptr);
  sqlite3_close(database);
  EXPECT_FALSE(openImport(folder / "view.db3", {}));
}

/// A member of a Protocol Buffer, by its encoding's rules: key, and what follows.
std::string member(unsigned number, const std::string& bytes) {
  std::string out = number < 16 ? std::string{static_cast<char>(number << 3 | 2)}
                                : std::string{static_cast<char>(0x80 | (number << 3 & 0x7f) | 2), static_cast<char>(number >> 4)};
  for (std::size_t size = bytes.size(); true; size >>= 7) {
    out += static_cast<char>((size & 0x7f) | (size > 0x7f ? 0x80 : 0));
    if (size <= 0x7f) return out + bytes;
  }
}
std::string fixed32(unsigned number, std::uint32_t value) { return static_cast<char>(number << 3 | 5) + std::string{reinterpret_cast<const char*>(&value), 4}; }
std::string doubles(std::initializer_list<double> numbers) { return {reinterpret_cast<const char*>(numbers.begin()), 8 * numbers.size()}; }
std::string fixed64(unsigned number, double value) { return static_cast<char>(number << 3 | 1) + doubles({value}); }

void writeProtobufMcap(const std::filesystem::path& file) {
  auto writer = record::mcap::FileWriter::create(file, {});
  ASSERT_TRUE(writer);
  const auto write = [&](const char* topic, const char* type, const std::string& bytes) {
    const auto schema = writer->addSchema({0, type, "protobuf", {}});
    const auto channel = writer->addChannel({0, *schema, topic, "protobuf", {}});
    const auto message = std::as_bytes(std::span{bytes});
    EXPECT_TRUE(writer->write({*channel, 0, 5, 5, {}}, std::span{&message, 1}));
  };
  const std::string stamp = member(1, std::string{"\x08\x80\xe2\xcf\xaa\x06\x10\x07", 8});  // 1700000000 s, 7 ns
  const std::string numbers{"\xdc\x05\x00\x00", 4};
  const std::string q = member(5, fixed64(2, 0.8) + fixed64(4, 0.6));
  write("/tf", "foxglove.FrameTransforms", member(1, stamp + member(2, "map") + member(3, "cam_optical") + member(4, fixed64(1, 1.5)) + q));
  write("/cam/depth/camera_info", "foxglove.CameraCalibration",
        fixed32(2, 2) + fixed32(3, 1) + member(4, "plumb_bob") + member(5, doubles({0.1, 0, 0, 0, 0})) + member(6, doubles({500, 0, 0.5, 0, 501, 0.25, 0, 0, 1})));
  write("/cam/depth/image", "foxglove.RawImage", stamp + member(7, "cam_optical") + fixed32(2, 2) + fixed32(3, 1) + member(4, "16UC1") + fixed32(5, 4) + member(6, numbers) + member(100, "more"));
  ASSERT_TRUE(writer->close());
}

TEST(Protobuf, ImagesLensesAndPosesOfFoxgloveAreRead) {
  const Folder folder;
  writeProtobufMcap(folder / "fox.mcap");
  const auto frames = framesIn(folder / "fox.mcap");
  expectDepthForBag(frames, 1);
  EXPECT_EQ(frames[0].time_ns, 1'700'000'000'000'000'007);
  ASSERT_TRUE(frames[0].world_from_camera);
  EXPECT_EQ(frames[0].world_from_camera->translation_m.x, 1.5);
  EXPECT_EQ(frames[0].world_from_camera->rotation_wxyz, (std::array{0.6, 0.0, 0.8, 0.0}));
}

// ROS 1: numbers and texts one after the other.
class Ros1Writer {
 public:
  std::string bytes;
  template <class Number>
  Ros1Writer& number(Number value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  Ros1Writer& text(const std::string& value) {
    number(static_cast<std::uint32_t>(value.size())).bytes += value;
    return *this;
  }
};
std::string ros1Depth(std::uint32_t nanosec) {
  Ros1Writer out;
  out.number(7u).number(1'700'000'000u).number(nanosec).text("cam_optical");  // seq, stamp, frame
  out.number(1u).number(2u).text("16UC1").number('\0').number(4u);           // height, width, encoding, big end, step
  out.number(4u).number(std::uint16_t{1'500}).number(std::uint16_t{0});
  return out.bytes;
}
std::string ros1Info() {
  Ros1Writer out;
  out.number(1u).number(1'700'000'000u).number(0u).text("cam_optical").number(1u).number(2u).text("plumb_bob").number(5u);
  for (const double term : {0.1, -0.2, 0.001, 0.002, 0.03}) out.number(term);
  for (const double term : {500.0, 0.0, 0.5, 0.0, 501.0, 0.25, 0.0, 0.0, 1.0}) out.number(term);
  for (int i = 0; i < 9 + 12; ++i) out.number(0.0);
  for (int i = 0; i < 6; ++i) out.number(0u);
  return (out.number('\0'), out.bytes);
}
std::string field(const std::string& name, const std::string& value) { return Ros1Writer{}.text(name + "=" + value).bytes; }
template <class Number>
std::string bytesOf(Number number) {
  return Ros1Writer{}.number(number).bytes;
}
std::string ros1Record(const std::string& header, const std::string& data) { return Ros1Writer{}.text(header).text(data).bytes; }
std::string ros1Connection(std::uint32_t id, const std::string& topic, const std::string& type) {
  return ros1Record(field("op", "\x07") + field("conn", bytesOf(id)) + field("topic", topic), field("topic", topic) + field("type", type));
}
std::string ros1Message(std::uint32_t id, std::uint32_t nanosec, const std::string& data) {
  return ros1Record(field("op", "\x02") + field("conn", bytesOf(id)) + field("time", bytesOf(1'700'000'000u) + bytesOf(nanosec)), data);
}

std::string packed(const std::string& compression, const std::string& bytes) {
  std::string out(bytes.size() + 4'096, '\0');
  if (compression == "none") return bytes;
  if (compression == "lz4") {
    out.resize(LZ4F_compressFrame(out.data(), out.size(), bytes.data(), bytes.size(), nullptr));
    return out;
  }
  auto size = static_cast<unsigned int>(out.size());
  std::string in = bytes;
  EXPECT_EQ(BZ2_bzBuffToBuffCompress(out.data(), &size, in.data(), static_cast<unsigned int>(in.size()), 9, 0, 0), BZ_OK);
  out.resize(size);
  return out;
}

std::string ros1Bag(const std::string& compression, bool is_closed) {
  const std::string connections = ros1Connection(0, "/cam/depth/image_raw", "sensor_msgs/Image") + ros1Connection(1, "/cam/depth/camera_info", "sensor_msgs/CameraInfo");
  std::string messages = connections + ros1Message(1, 0, ros1Info());
  for (std::uint32_t i = 0; i < 4; ++i) messages += ros1Message(0, i, ros1Depth(i));
  const std::string chunk = ros1Record(field("op", "\x05") + field("compression", compression) + field("size", bytesOf(static_cast<std::uint32_t>(messages.size()))),
                                       packed(compression, messages));
  const std::string start = "#ROSBAG V2.0\n" + ros1Record(field("op", "\x03") + field("index_pos", bytesOf(std::uint64_t{0})), std::string(100, ' '));
  return start + chunk + (is_closed ? connections : "");
}

class Ros1 : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Compressions, Ros1, testing::Values("none", "bz2", "lz4"), [](const auto& one) { return std::string{one.param}; });

TEST_P(Ros1, FramesOfABagComeWhetherItWasClosedOrNot) {
  const Folder folder;
  for (const bool is_closed : {true, false}) {
    std::ofstream{folder / "run.bag", std::ios::binary} << ros1Bag(GetParam(), is_closed);
    expectDepthForBag(framesIn(folder / "run.bag"), 4);
  }
}

TEST_P(Ros1, EveryCutAndManyDamagedBytesAreAnErrorOrFewerFrames) {
  const Folder folder;
  const std::string whole = ros1Bag(GetParam(), true);
  std::mt19937 random{1};
  for (int i = 0; i < 150; ++i) {
    std::string bytes = whole;
    if (i % 2 == 0) bytes.resize(random() % bytes.size());
    else bytes[random() % bytes.size()] = static_cast<char>(random());
    std::ofstream{folder / "cut.bag", std::ios::binary} << bytes;
    auto source = openImport(folder / "cut.bag", {});
    std::size_t frames = 0;
    while (source && (*source)->next()) ++frames;
    EXPECT_LE(frames, 4u);
  }
}

TEST(BagFolder, FilesOfABagThatWasSplitFollowEachOtherInTheOrderOfTheirNumbers) {
  const Folder folder;
  std::filesystem::create_directory(folder / "bag");
  writeDb3(folder / "bag/run_10.db3", 4);
  writeDb3(folder / "bag/run_9.db3", 0);
  const auto frames = framesIn(folder / "bag");
  expectDepthForBag(frames, 8);
  for (std::size_t i = 0; i < frames.size(); ++i) EXPECT_EQ(*frames[i].time_ns % 1'000, static_cast<std::int64_t>(i));
}

TEST(Topics, OneCameraIsItsDepthInfraredPointsAndLens) {
  const auto role = [](const char* topic, const char* type) { return roleOf({topic, type, Dialect::Cdr}); };
  EXPECT_EQ(role("/front/depth/image_raw", "sensor_msgs/Image").camera, "/front");
  EXPECT_EQ(role("/front/infra1/image_rect_raw", "sensor_msgs/Image").camera, "/front");
  EXPECT_EQ(role("/front/infra1/image_rect_raw", "sensor_msgs/Image").plane, PlaneKind::Amplitude);
  EXPECT_EQ(role("/front/points", "sensor_msgs/PointCloud2").camera, "/front");
  EXPECT_EQ(role("/front/depth/camera_info", "sensor_msgs/CameraInfo").space, "/front/depth");
  EXPECT_EQ(role("/front/depth/image_raw/compressedDepth", "sensor_msgs/CompressedImage").camera, "/front");
  EXPECT_EQ(role("/depth/image_raw", "sensor_msgs/Image").camera, "");
  EXPECT_EQ(role("/camera/aligned_depth_to_color/image_raw", "sensor_msgs/Image").camera, "/camera/aligned_depth_to_color");
  EXPECT_EQ(role("/front/depth/image_raw", "std_msgs/String").kind, TopicRole::Kind::None);
}

TEST(Images, CompressedDepthIsThePngBehindTwelveBytes) {
  cv::Mat counts(1, 2, CV_16U);
  counts.at<std::uint16_t>(0, 0) = 2'345;
  counts.at<std::uint16_t>(0, 1) = 0;
  std::vector<std::byte> bytes(12);
  const auto png = pictures::encodePng(counts);
  bytes.insert(bytes.end(), png.begin(), png.end());
  ros::CompressedImage image;
  image.format = "16UC1; compressedDepth png";
  image.data = bytes;
  const auto unpacked = unpack(image, {}, 1.0);
  ASSERT_TRUE(unpacked) << unpacked.error().message;
  EXPECT_EQ(unpacked->kind, PlaneKind::Depth);
  EXPECT_FLOAT_EQ(unpacked->plane.as<float>()[0], 2.345f);
  EXPECT_TRUE(std::isnan(unpacked->plane.as<float>()[1]));
}

TEST(Images, CompressedDepthOfFloatsIsAnInverseOfItsCounts) {
  cv::Mat counts(1, 1, CV_16U);
  counts.at<std::uint16_t>(0, 0) = 300;
  const struct {
    std::int32_t format;
    float a, b;
  } head{0, 500.0f, 100.0f};
  const auto start = std::as_bytes(std::span{&head, 1});
  std::vector<std::byte> bytes{start.begin(), start.end()};
  const auto png = pictures::encodePng(counts);
  bytes.insert(bytes.end(), png.begin(), png.end());
  ros::CompressedImage image;
  image.format = "32FC1; compressedDepth";
  image.data = bytes;
  const auto unpacked = unpack(image, {}, 1.0);
  ASSERT_TRUE(unpacked) << unpacked.error().message;
  EXPECT_FLOAT_EQ(unpacked->plane.as<float>()[0], 2.5f);  // 500 / (300 - 100)
}

TEST(Images, RowsWithGapsAndTheBigEndFirstAreRead) {
  const std::array<std::uint8_t, 7> data{0x05, 0xDC, 0xff, 0xff, 0x03, 0xE8, 0xff};  // 1500; a gap of two; 1000; short of the last gap
  ros::Image image;
  image.width = 1;
  image.height = 2;
  image.encoding = "16UC1";
  image.is_bigendian = 1;
  image.step = 4;
  image.data = std::as_bytes(std::span{data});
  const auto plane = planeOf(image, PlaneKind::Depth, 1.0);
  ASSERT_TRUE(plane) << plane.error().message;
  EXPECT_FLOAT_EQ(plane->as<float>()[0], 1.5f);
  EXPECT_FLOAT_EQ(plane->as<float>()[1], 1.0f);
}

TEST(Images, AnImageThatSaysMoreThanItHasIsAnError) {
  ros::Image image = depthForBag(0);
  image.height = 0xffff'ffffu;
  EXPECT_FALSE(planeOf(image, PlaneKind::Depth, 1.0));
  image = depthForBag(0);
  image.step = 0xffff'ffffu;
  EXPECT_TRUE(planeOf(image, PlaneKind::Depth, 1.0)) << "the only row needs no gap behind it";
  image.height = 2;
  EXPECT_FALSE(planeOf(image, PlaneKind::Depth, 1.0));
}

TEST(Clouds, AnOrganisedCloudIsRangeAndDepthAndItsIntensity) {
  const float points[]{3.0f, 0.0f, 4.0f, 7.0f, NAN, NAN, NAN, 8.0f};
  ros::PointCloud2 cloud;
  cloud.width = 1;
  cloud.height = 2;
  for (const char* name : {"x", "y", "z", "intensity"})
    cloud.fields.push_back({name, static_cast<std::uint32_t>(4 * cloud.fields.size()), ros::kFloat32, 1});
  cloud.point_step = cloud.row_step = 16;
  cloud.data = std::as_bytes(std::span{points});
  const auto planes = planesOf(cloud);
  ASSERT_TRUE(planes) << planes.error().message;
  ASSERT_EQ(planes->size(), 3u);
  EXPECT_EQ((*planes)[0].as<float>()[0], 5.0f);
  EXPECT_EQ((*planes)[1].as<float>()[0], 4.0f);
  EXPECT_EQ((*planes)[2].as<float>()[1], 8.0f);
  EXPECT_TRUE(std::isnan((*planes)[0].as<float>()[1]));
  cloud.fields[2].offset = 13;
  EXPECT_FALSE(planesOf(cloud)) << "a field beyond its point";
}

TEST(TransformTree, APoseIsThatOfAllFramesAboveAtThatTime) {
  const auto message = [](std::int32_t sec, const char* parent, const char* child, double x) {
    ros::TFMessage all;
    all.transforms.push_back({{{sec, 0}, parent}, child, {{x, 0.0, 0.0}, {0.0, 0.0, 0.0, 1.0}}});
    return all;
  };
  Transforms transforms;
  transforms.add(message(5, "base", "camera", 0.25), true);
  transforms.add(message(10, "map", "base", 1.0), false);
  transforms.add(message(11, "map", "base", 3.0), false);
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  const auto near = transforms.poseOf("camera", 10 * kSecond_ns + kSecond_ns / 20);
  ASSERT_TRUE(near);
  EXPECT_NEAR(near->translation_m.x, 1.1 + 0.25, 1e-12);
  EXPECT_FALSE(transforms.poseOf("camera", 10 * kSecond_ns + kSecond_ns / 2)) << "half a second from what was told";
  EXPECT_FALSE(transforms.poseOf("map", 10 * kSecond_ns));
  EXPECT_EQ(transforms.rootOf("camera"), "map");
  transforms.add(message(10, "camera", "map", 0.0), true);
  EXPECT_TRUE(transforms.rootOf("camera").size() > 0) << "a circle ends";
}

}  // namespace
}  // namespace toftwin::cli
