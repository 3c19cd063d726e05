// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/info_bag.h"

#include <fmt/format.h>

#include <set>

#include "tools/cli/describe.h"
#include "tools/cli/import/bag/topic_role.h"

namespace toftwin::cli {
namespace {

const char* wordFor(Dialect dialect) {
  switch (dialect) {
    case Dialect::Cdr: return "ROS 2";
    case Dialect::Ros1: return "ROS 1";
    case Dialect::FlatBuffers: return "FlatBuffers";
    case Dialect::Protobuf: return "Protobuf";
    case Dialect::Other: break;
  }
  return "not read here";
}

bool makesFrames(const TopicRole& role) {
  using Kind = TopicRole::Kind;
  return role.kind == Kind::Image || role.kind == Kind::Compressed || role.kind == Kind::Cloud;
}

}  // namespace

Result<Exit> describeBag(const std::string& what, bool as_json) {
  const auto bag = openBag(what);
  if (!bag) return bag.error();
  if ((*bag)->topics().empty()) (void)(*bag)->next();  // a bag that was not closed says its topics in its chunks
  compare::Json topics = compare::Json::array();
  std::string text = fmt::format("{}: bag of {}", what, (*bag)->messages() > 0 ? fmt::format("{} messages\n", (*bag)->messages()) : "messages\n");
  std::set<std::string> cameras;
  for (const BagTopic& topic : (*bag)->topics()) {
    const TopicRole role = roleOf(topic);
    if (makesFrames(role)) cameras.insert(sourceNameOf(role.camera));
    text += fmt::format("  {:<40} {:<32} {}\n", topic.name, topic.type, wordFor(topic.dialect));
    topics.push(compare::Json::object().set("name", topic.name).set("type", topic.type).set("written", std::string{wordFor(topic.dialect)})
                    .set("is_frames", makesFrames(role)));
  }
  text += cameras.empty() ? "none of it is frames that toftwin import takes\n"
                          : fmt::format("toftwin import makes a recording of: {}\n", fmt::join(cameras, ", "));
  const std::string damage = (*bag)->damage();
  if (as_json) fmt::print("{}", compare::Json::object().set("file", what).set("kind", std::string{"bag"}).set("topics", topics).set("damage", damage).text());
  else fmt::print("{}", text);
  if (damage.empty()) return Exit::Ok;
  fmt::print(stderr, "{}\n", damage);
  return Exit::Incomplete;
}

}  // namespace toftwin::cli
