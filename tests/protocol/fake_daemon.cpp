// SPDX-License-Identifier: Apache-2.0
#include "fake_daemon.h"

#include <stdlib.h>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>

#include <filesystem>
#include <future>
#include <stdexcept>

namespace toftwin {
namespace {

namespace asio = boost::asio;

template <class Protocol>
auto acceptorOf(asio::io_context& io, const typename Protocol::endpoint& endpoint) {
  return std::make_shared<typename Protocol::acceptor>(io, endpoint);
}

/// Accepts one connection each time it is called.
template <class Acceptor>
auto acceptOnce(std::shared_ptr<Acceptor> acceptor) {
  return [acceptor](std::function<void(transport::Socket)> then) {
    acceptor->async_accept([then](boost::system::error_code fault, auto socket) {
      if (!fault) then(transport::Socket{std::move(socket)});
    });
  };
}

}  // namespace

FakeDaemon::Session::Session(transport::Socket socket, FakeDaemon& daemon)
    : socket_(std::move(socket)), daemon_(daemon) {
  transport::setNoDelay(socket_.socket());
}

void FakeDaemon::Session::read() {
  socket_.asyncRead([self = shared_from_this()](Result<wire::Message> message) {
    if (!message) return;
    self->daemon_.script_(*self, *message);
    if (self->socket_.isOpen()) self->read();
  });
}

void FakeDaemon::Session::send(const wire::Message& message) { write({*wire::encode(message), {}}); }

void FakeDaemon::Session::sendShared(const wire::FrameMessage& message) {
  wire::Body body = wire::encodeBody(message.frame.planes);
  auto shared = transport::SharedBody::create(body);
  if (!shared) throw std::runtime_error{shared.error().message};
  write({*wire::encode(message, std::move(body)), std::move(*shared)});
}

void FakeDaemon::Session::sendBytes(std::vector<std::byte> bytes) {
  write({{std::move(bytes), {}}, {}});
}

void FakeDaemon::Session::write(Output output) {
  output_.push_back(std::move(output));
  if (!writing_) writeNext();
}

void FakeDaemon::Session::writeNext() {
  writing_ = !output_.empty();
  if (!writing_) return;
  Output next = std::move(output_.front());
  output_.pop_front();
  const auto wrote = [self = shared_from_this()](const Result<>& result) {
    if (result) self->writeNext();
  };
  if (next.body)
    socket_.asyncWrite(std::move(next.message), std::move(next.body), wrote);
  else
    socket_.asyncWrite(std::move(next.message), wrote);
}

FakeDaemon::FakeDaemon(On where, Script script) : script_(std::move(script)) {
  if (where == On::Unix) {
    std::string pattern = (std::filesystem::temp_directory_path() / "toftwin-XXXXXX").string();
    if (!::mkdtemp(pattern.data())) throw std::runtime_error{"mkdtemp failed"};
    folder_ = pattern;
    const std::string path = folder_ + "/fake.sock";
    address_ = "unix:" + path;
    accept_next_ = acceptOnce(acceptorOf<asio::local::stream_protocol>(io_, {path}));
  } else {
    const auto acceptor = acceptorOf<asio::ip::tcp>(io_, {asio::ip::address_v4::loopback(), 0});
    address_ = "tcp:127.0.0.1:" + std::to_string(acceptor->local_endpoint().port());
    accept_next_ = acceptOnce(acceptor);
  }
  accept();
  thread_ = std::thread{[this] { io_.run(); }};
}

FakeDaemon::~FakeDaemon() {
  io_.stop();
  thread_.join();
  accept_next_ = {};
  if (!folder_.empty()) std::filesystem::remove_all(folder_);
}

void FakeDaemon::accept() {
  accept_next_([this](transport::Socket socket) {
    sessions_.push_back(std::make_shared<Session>(std::move(socket), *this));
    sessions_.back()->read();
    accept();
  });
}

void FakeDaemon::forEachSession(const std::function<void(Session&)>& work) {
  std::promise<void> done;
  asio::post(io_, [&] {
    for (const auto& session : sessions_) work(*session);
    done.set_value();
  });
  done.get_future().wait();
}

FakeDaemon::Script FakeDaemon::polite(Script more) {
  return [more](Session& session, const wire::Message& message) {
    if (const auto* hello = std::get_if<wire::Hello>(&message)) {
      session.send(wire::Hello{hello->id, "fake daemon 1.0", {transport::kMemfdFeature}});
    } else if (const auto* subscribe = std::get_if<wire::Subscribe>(&message)) {
      session.send(wire::Subscribed{subscribe->id, 7});
      more(session, message);
    } else {
      more(session, message);
    }
  };
}

}  // namespace toftwin
