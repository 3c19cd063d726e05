// SPDX-License-Identifier: Apache-2.0
#include "daemon/metrics.h"

#include <gmock/gmock.h>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>

#include <set>
#include <sstream>
#include <thread>

#include "fakes.h"

namespace toftwin::daemon {
namespace {

using boost::asio::ip::tcp;
using testing::HasSubstr;

std::string textOf(Hub& hub) {
  hub.traffic().frames = 7;
  hub.traffic().latency.count(std::chrono::milliseconds{3});
  hub.traffic().latency.count(std::chrono::seconds{3});
  return openMetrics(hub, 5);
}

struct WithCamera {
  test::FakeClock clock;
  Hub hub{{}, clock};
  WithCamera() {
    const auto open = test::opener(std::make_shared<test::Remote>());
    hub.add(std::make_shared<SourceHost>("cam", open, open(), SourceHost::Options{}, clock));
  }
};

TEST(Metrics, TellOfSourcesClientsMemoryAndTheLog) {
  WithCamera daemon;
  const std::string text = textOf(daemon.hub);
  for (const char* line :
       {"toftwin_source_frames_total{source=\"cam\"} 0\n", "toftwin_source_recording{source=\"cam\"} 0\n",
        "toftwin_frames_sent_total 7\n", "toftwin_frame_latency_seconds_bucket{le=\"0.002\"} 0\n",
        "toftwin_frame_latency_seconds_bucket{le=\"0.005\"} 1\n", "toftwin_frame_latency_seconds_bucket{le=\"+Inf\"} 2\n",
        "toftwin_frame_latency_seconds_count 2\n", "toftwin_backlog_limit_bytes{of=\"clients\"} 2147483648\n",
        "toftwin_log_lines_lost_total 5\n", "toftwin_sessions 0\n"}) {
    EXPECT_THAT(text, HasSubstr(line));
  }
}

/// OpenMetrics 1.0: each family has its head once, then its samples; the end is marked.
TEST(Metrics, AreWrittenAsOpenMetrics) {
  WithCamera daemon;
  const std::string text = textOf(daemon.hub);
  EXPECT_TRUE(text.ends_with("# EOF\n"));
  std::istringstream lines{text};
  std::set<std::string> families;
  std::string family;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("# TYPE ")) {
      family = line.substr(7, line.find(' ', 7) - 7);
      EXPECT_TRUE(families.insert(family).second) << family << " has two heads";
    } else if (!line.starts_with('#')) {
      EXPECT_TRUE(line.starts_with(family)) << line << " is not of " << family;
    }
  }
  EXPECT_GT(families.size(), 12u);
}

class Asked {
 public:
  Asked() : server_(*MetricsServer::open(io_, 0, [] { return std::string{"all is well\n# EOF\n"}; })) {
    thread_ = std::jthread{[this] { io_.run(); }};
  }
  ~Asked() { io_.stop(); }
  tcp::socket connect() {
    tcp::socket socket{own_};
    socket.connect({boost::asio::ip::address_v4::loopback(), server_->port()});
    return socket;
  }
  std::string answerTo(const std::string& question) {
    auto socket = connect();
    boost::asio::write(socket, boost::asio::buffer(question));
    std::string answer;
    boost::system::error_code end;
    boost::asio::read(socket, boost::asio::dynamic_buffer(answer), end);
    return answer;
  }

 private:
  boost::asio::io_context io_{1}, own_;
  std::unique_ptr<MetricsServer> server_;
  std::jthread thread_;
};

TEST(MetricsServer, AnswersThatOneQuestionAndNoOther) {
  Asked server;
  const std::string answer = server.answerTo("GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_THAT(answer, HasSubstr("200 OK"));
  EXPECT_THAT(answer, HasSubstr("application/openmetrics-text; version=1.0.0"));
  EXPECT_THAT(answer, HasSubstr("all is well\n# EOF\n"));
  EXPECT_THAT(server.answerTo("GET /etc/passwd HTTP/1.1\r\nHost: x\r\n\r\n"), HasSubstr("404"));
  EXPECT_THAT(server.answerTo("POST /metrics HTTP/1.1\r\nHost: x\r\nContent-Length: 0\r\n\r\n"), HasSubstr("404"));
}

TEST(MetricsServer, ThoseWhoAskNothingKeepNobodyOut) {
  Asked server;
  std::vector<tcp::socket> silent;
  for (int i = 0; i < 64; ++i) silent.push_back(server.connect());
  EXPECT_THAT(server.answerTo("GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n"), HasSubstr("all is well"));
}

}  // namespace
}  // namespace toftwin::daemon
