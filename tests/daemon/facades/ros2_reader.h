// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <vector>

/// Debian's Fast DDS frees statistics of its readers with another size than it got; that is not ours to find.
extern "C" [[gnu::used]] inline const char* __asan_default_options() {  // NOLINT: AddressSanitizer's name
  return "new_delete_type_mismatch=0";
}

/// A program of ROS 2 as far as the network sees it: another maker's DDS (Fast DDS, what ROS 2 itself uses
/// first), and a decoder of its own.
namespace toftwin::test {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

using Cdr = std::vector<std::uint8_t>;

/// A type of which only the name is known; messages are bytes with their four bytes of encapsulation.
class RawType final : public dds::TopicDataType {
 public:
  explicit RawType(const char* name) {
    setName(name);
    m_typeSize = 1U << 16U;
    m_isGetKeyDefined = false;
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    const auto& bytes = *static_cast<Cdr*>(data);
    if (bytes.size() > payload->max_size) return false;
    std::memcpy(payload->data, bytes.data(), bytes.size());
    payload->length = static_cast<std::uint32_t>(bytes.size());
    payload->encapsulation = CDR_LE;
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    static_cast<Cdr*>(data)->assign(payload->data, payload->data + payload->length);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<Cdr*>(data)->size()); };
  }
  void* createData() override { return new Cdr; }
  void deleteData(void* data) override { delete static_cast<Cdr*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

/// Reads what XCDR version 1 writes, in little endian: numbers lie at multiples of their size.
class CdrReader {
 public:
  explicit CdrReader(Cdr message) : bytes_(std::move(message)) {
    EXPECT_GE(bytes_.size(), 4U);
    EXPECT_EQ(bytes_.at(1), 1) << "little endian";
  }
  template <class T>
  T number() {
    at_ += (sizeof(T) - at_ % sizeof(T)) % sizeof(T);
    T value{};
    if (kHead + at_ + sizeof(T) > bytes_.size()) {
      ADD_FAILURE() << "the message ends at " << bytes_.size();
      return value;
    }
    std::memcpy(&value, bytes_.data() + kHead + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  std::string text() {
    const auto size = number<std::uint32_t>();
    std::string all;
    for (std::uint32_t i = 0; i < size; ++i) all += number<char>();
    EXPECT_TRUE(!all.empty() && all.back() == '\0');
    if (!all.empty()) all.pop_back();
    return all;
  }
  template <class T>
  std::vector<T> numbers(std::size_t count) {
    std::vector<T> all(count);
    for (T& one : all) one = number<T>();
    return all;
  }
  template <class T>
  std::vector<T> sequence() {
    return numbers<T>(number<std::uint32_t>());
  }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - kHead - at_; }

 private:
  static constexpr std::size_t kHead = 4;
  Cdr bytes_;
  std::size_t at_ = 0;
};

class CdrWriter {
 public:
  template <class T>
  CdrWriter& number(T value) {
    bytes_.resize(bytes_.size() + (sizeof(T) - (bytes_.size() - 4) % sizeof(T)) % sizeof(T));
    const std::size_t at = bytes_.size();
    bytes_.resize(at + sizeof(T));
    std::memcpy(bytes_.data() + at, &value, sizeof(T));
    return *this;
  }
  CdrWriter& text(const std::string& all) {
    number(static_cast<std::uint32_t>(all.size() + 1));
    bytes_.insert(bytes_.end(), all.begin(), all.end());
    bytes_.push_back(0);
    return *this;
  }
  Cdr& bytes() { return bytes_; }

 private:
  Cdr bytes_{0, 1, 0, 0};
};

/// Nothing: as the library has a reader by default.
enum class Asks { Nothing, SensorData, Reliable, Latched };

/// A participant on the loopback interface alone.
class RosProgram {
 public:
  explicit RosProgram(int domain) {
    auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    udp->interfaceWhiteList.emplace_back("127.0.0.1");
    udp->receiveBufferSize = 4'000'000;
    dds::DomainParticipantQos qos;
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(udp);
    rtps::Locator_t peer;
    rtps::IPLocator::setIPv4(peer, 127, 0, 0, 1);
    qos.wire_protocol().builtin.initialPeersList.push_back(peer);
    participant_ = factory().create_participant(static_cast<std::uint32_t>(domain), qos);
    EXPECT_NE(participant_, nullptr);
  }
  ~RosProgram() {
    participant_->delete_contained_entities();
    factory().delete_participant(participant_);
  }
  RosProgram(const RosProgram&) = delete;
  RosProgram& operator=(const RosProgram&) = delete;

  dds::DataReader* read(const std::string& name, const char* type, Asks asks = Asks::SensorData) {
    dds::DataReaderQos qos = dds::DATAREADER_QOS_DEFAULT;
    // Of messages without a longest one.
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    if (asks != Asks::Nothing) choose(qos, asks);
    return participant_->create_subscriber(dds::SUBSCRIBER_QOS_DEFAULT)
        ->create_datareader(topic(name, type), qos);
  }
  static void choose(dds::DataReaderQos& qos, Asks asks) {
    qos.reliability().kind =
        asks == Asks::SensorData ? dds::BEST_EFFORT_RELIABILITY_QOS : dds::RELIABLE_RELIABILITY_QOS;
    qos.durability().kind =
        asks == Asks::Latched ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
    qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = 50;
  }
  dds::DataWriter* write(const std::string& name, const char* type) {
    dds::DataWriterQos qos = dds::DATAWRITER_QOS_DEFAULT;
    qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
    qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    return participant_->create_publisher(dds::PUBLISHER_QOS_DEFAULT)
        ->create_datawriter(topic(name, type), qos);
  }

 private:
  static dds::DomainParticipantFactory& factory() { return *dds::DomainParticipantFactory::get_instance(); }
  dds::Topic* topic(const std::string& name, const char* type) {
    dds::TypeSupport support{new RawType{type}};
    support->auto_fill_type_information(false);
    support->auto_fill_type_object(false);
    support.register_type(participant_);
    const std::string full = name.starts_with('/') ? "rt" + name : name;  // or one of ROS 2's own
    if (auto* known = participant_->lookup_topicdescription(full)) return dynamic_cast<dds::Topic*>(known);
    return participant_->create_topic(full, type, dds::TOPIC_QOS_DEFAULT);
  }
  dds::DomainParticipant* participant_;
};

/// The next message, or nothing after half a minute. Puts the identifier of its writer in, where it is asked for.
inline std::optional<Cdr> nextOf(dds::DataReader* reader, std::vector<std::uint8_t>* writer = nullptr) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds{30};
  while (std::chrono::steady_clock::now() < deadline) {
    Cdr message;
    dds::SampleInfo info;
    if (reader->take_next_sample(&message, &info) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
      if (writer != nullptr) {
        writer->clear();
        for (std::size_t i = 0; i < 16; ++i) writer->push_back(info.publication_handle.value[i]);
      }
      if (info.valid_data) return message;
      continue;
    }
    reader->wait_for_unread_message(eprosima::fastrtps::Duration_t{1, 0});
  }
  return std::nullopt;
}

}  // namespace toftwin::test
