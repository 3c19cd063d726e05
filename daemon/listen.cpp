// SPDX-License-Identifier: Apache-2.0
#include "daemon/listen.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <fstream>
#include <optional>
#include <sstream>
#include <system_error>

namespace toftwin::daemon {
namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;
using asio::ip::tcp;
using boost::system::error_code;
using Local = asio::local::stream_protocol;

Error cannotListen(const std::string& where, const error_code& fault, const std::string& holder,
                   std::string_view setting) {
  using Code = Error::Code;
  const int number = fault.value();
  if (number == EADDRINUSE) {
    return {Code::Busy, fmt::format("{} is in use by {}: stop that, or choose another port with {}", where, holder,
                                    setting)};
  }
  if (number == EACCES) {
    return {Code::PermissionDenied,
            fmt::format("{} may not be used by this user: ports below 1024 are "
                        "for root; choose a higher one with {}, or give the daemon "
                        "CAP_NET_BIND_SERVICE",
                        where, setting)};
  }
  if (number == EADDRNOTAVAIL) {
    return {Code::InvalidArgument,
            fmt::format("{}: this machine does not have that address; see `ip address`", where)};
  }
  return {Code::Internal, fmt::format("{}: cannot listen: {}", where, fault.message())};
}

/// The inode of the socket that listens on the port, from a table like /proc/net/tcp. Its columns:
/// number, local address "hex:port", remote address, state (0A: listening), …, inode the tenth.
std::optional<std::string> inodeListening(const char* table, std::uint16_t port) {
  std::ifstream lines{table};
  const std::string wanted = fmt::format(":{:04X}", port);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words{line};
    std::array<std::string, 10> column;
    for (std::string& word : column) words >> word;
    if (column[1].ends_with(wanted) && column[3] == "0A") return column[9];
  }
  return std::nullopt;
}

std::string nameOfProcess(const std::string& pid) {
  std::string name;
  std::getline(std::ifstream{"/proc/" + pid + "/comm"} >> std::ws, name);
  return fmt::format("{} (pid {})", name.empty() ? "a process" : name, pid);
}

bool isOpenIn(const fs::path& process, const std::string& link) {
  std::error_code fault;
  for (fs::directory_iterator file{process / "fd", fault}, end; !fault && file != end;
       file.increment(fault)) {
    std::error_code unreadable;
    if (fs::read_symlink(file->path(), unreadable) == link) return true;
  }
  return false;
}

/// Takes the lock, or tells who has it. The file stays: removing it would let a third process lock
/// another file of the same name.
Result<transport::FileDescriptor> takeLock(const fs::path& socket) {
  const fs::path file = socket.string() + ".lock";
  transport::FileDescriptor lock{
      ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600)};
  if (!lock) {
    const bool is_denied = errno == EACCES || errno == EROFS || errno == EPERM;
    return Error{
        is_denied ? Error::Code::PermissionDenied : Error::Code::StorageFull,
        fmt::format("{}: cannot be made: {}; the folder must exist and be writable for this "
                    "user, or choose another socket with listen.socket or --socket",
                    file.string(), std::generic_category().message(errno))};
  }
  if (::flock(lock.get(), LOCK_EX | LOCK_NB) != 0) {
    std::array<char, 16> pid{};
    const auto count = ::pread(lock.get(), pid.data(), pid.size() - 1, 0);
    return Error{
        Error::Code::Busy,
        fmt::format("another daemon (pid {}) serves {} already: stop it, or choose another "
                    "socket with listen.socket or --socket",
                    count > 0 ? pid.data() : "unknown", socket.string())};
  }
  const std::string pid = std::to_string(::getpid());
  if (::ftruncate(lock.get(), 0) != 0 ||
      ::pwrite(lock.get(), pid.data(), pid.size(), 0) != static_cast<ssize_t>(pid.size())) {
    return Error{Error::Code::StorageFull, fmt::format("{}: cannot be written", file.string())};
  }
  return lock;
}

/// Makes way for a new socket: removes one that nobody answers on, refuses anything else.
Result<> clearPath(asio::io_context& io, const fs::path& path) {
  std::error_code fault;
  const auto type = fs::symlink_status(path, fault).type();
  if (type == fs::file_type::not_found) return {};
  if (type != fs::file_type::socket) {
    return Error{
        Error::Code::InvalidArgument,
        fmt::format("{} exists and is not a socket; it is left alone. Remove it, or choose "
                    "another socket with listen.socket or --socket",
                    path.string())};
  }
  Local::socket probe{io};
  error_code refused;
  probe.connect(Local::endpoint{path.string()}, refused);
  if (!refused) {
    return Error{Error::Code::Busy, fmt::format("another program answers on {}: stop it, or choose "
                                                "another socket with listen.socket or --socket",
                                                path.string())};
  }
  fs::remove(path, fault);
  if (fault) {
    return Error{
        Error::Code::PermissionDenied,
        fmt::format("{} is left over and cannot be removed: {}", path.string(), fault.message())};
  }
  return {};
}

}  // namespace

std::string whoListensOn(std::uint16_t port) {
  auto inode = inodeListening("/proc/net/tcp", port);
  if (!inode) inode = inodeListening("/proc/net/tcp6", port);
  if (!inode) return "another process";
  const std::string link = "socket:[" + *inode + "]";
  std::error_code fault;
  for (fs::directory_iterator process{"/proc", fault}, end; !fault && process != end;
       process.increment(fault)) {
    const std::string pid = process->path().filename();
    if (pid.find_first_not_of("0123456789") == std::string::npos &&
        isOpenIn(process->path(), link)) {
      return nameOfProcess(pid);
    }
  }
  return "another user's process";
}

Result<tcp::acceptor> listenTcp(asio::io_context& io, const std::string& address,
                                std::uint16_t port, std::string_view setting) {
  const std::string where = fmt::format("TCP port {} of {}", port, address);
  error_code fault;
  const auto ip = asio::ip::make_address(address == "localhost" ? "127.0.0.1" : address, fault);
  if (fault) {
    return Error{
        Error::Code::InvalidArgument,
        fmt::format("the address \"{}\" is no IP address, such as 127.0.0.1 or ::1", address)};
  }
  tcp::acceptor acceptor{io};
  const tcp::endpoint endpoint{ip, port};
  acceptor.open(endpoint.protocol(), fault);
  if (!fault) acceptor.set_option(tcp::acceptor::reuse_address{true}, fault);
  if (!fault) acceptor.bind(endpoint, fault);
  if (!fault) acceptor.listen(asio::socket_base::max_listen_connections, fault);
  if (fault) return cannotListen(where, fault, whoListensOn(port), setting);
  return acceptor;
}

Result<UnixListener> UnixListener::open(asio::io_context& io, const fs::path& path) {
  constexpr std::size_t kLongest = 107;  // sockaddr_un::sun_path with its terminating zero
  if (path.string().size() > kLongest) {
    return Error{Error::Code::InvalidArgument,
                 fmt::format("the socket's path has {} bytes, the system allows {}: {}",
                             path.string().size(), kLongest, path.string())};
  }
  auto lock = takeLock(path);
  if (!lock) return lock.error();
  if (auto cleared = clearPath(io, path); !cleared) return cleared.error();
  Local::acceptor acceptor{io};
  error_code fault;
  acceptor.open(Local{}, fault);
  if (!fault) acceptor.bind(Local::endpoint{path.string()}, fault);
  if (!fault) acceptor.listen(asio::socket_base::max_listen_connections, fault);
  // As open as the loopback port beside it, which every user of this machine can reach, too. Who
  // wants less closes the folder.
  if (!fault && ::chmod(path.c_str(), 0666) != 0) fault = {errno, boost::system::system_category()};
  if (fault) return cannotListen(path.string(), fault, "another process", "listen.socket");
  return UnixListener{path, *std::move(lock), std::move(acceptor)};
}

UnixListener::~UnixListener() {
  if (!lock_) return;  // moved from
  std::error_code ignored;
  fs::remove(path_, ignored);
}

}  // namespace toftwin::daemon
