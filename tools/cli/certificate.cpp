// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <memory>

#include "protocol/transport/certificates.h"
#include "tools/cli/command.h"

namespace toftwin::cli {
namespace certificate_command {

struct Options {
  std::string what;
  std::string folder;
  std::string name;
  std::vector<std::string> hosts;
  int days = 825;
};

Result<> check(const Options& options) {
  const auto usage = [](std::string what) { return Error{Error::Code::InvalidArgument, std::move(what)}; };
  if (options.what != "authority" && options.name.empty()) return usage("NAME is missing: whose certificate is it?");
  if (options.what == "daemon" && options.hosts.empty())
    return usage("--host is missing: clients compare it with the name or address by which they call the daemon");
  if (options.what != "daemon" && !options.hosts.empty()) return usage("--host is of a daemon's certificate");
  return {};
}

Result<Exit> run(const Options& options) {
  const std::filesystem::path folder = options.folder;
  if (options.what == "authority") {
    const std::string name = options.name.empty() ? "toftwin authority" : options.name;
    if (auto made = transport::makeAuthority(folder, name, options.days); !made) return made.error();
    fmt::print("{}: give it to every client and daemon\n{}: whoever has it can be anybody; keep it off the network\n",
               (folder / "authority.pem").string(), (folder / "authority.key").string());
    return Exit::Ok;
  }
  if (auto made = transport::makeCertificate(folder, {options.name, options.hosts, options.days}); !made)
    return made.error();
  fmt::print("{0}.pem and {0}.key, signed by {1}\n", (folder / options.name).string(), (folder / "authority.pem").string());
  return Exit::Ok;
}

}  // namespace certificate_command

Command certificateCommand() {
  using namespace certificate_command;
  return {"certificate", "make the certificates of TLS, with a small authority of one's own",
          "  toftwin certificate authority ca               ca/authority.pem and its key\n"
          "  toftwin certificate daemon ca dock --host dock.local --host 10.0.0.5\n"
          "  toftwin certificate client ca plc              [roles] know it as certificate:plc\n",
          [](Arguments& args) -> Run {
            const auto options = std::make_shared<Options>();
            args.option("WHAT", options->what, "authority, or a certificate that it signs: of a daemon or a client")
                .oneOf({"authority", "daemon", "client"})
                .required();
            args.option("FOLDER", options->folder, "where the authority is; nothing there is overwritten").required();
            args.option("NAME", options->name, "whose certificate it is: its common name, and the files' name");
            args.option("--host", options->hosts, "name or address by which clients call the daemon; several times for several")
                .oneAtATime();
            args.option("--days", options->days, "how long it holds").within(1, 36500).showsDefault();
            args.check([options] { return certificate_command::check(*options); });
            return [options] { return certificate_command::run(*options); };
          }};
}

}  // namespace toftwin::cli
