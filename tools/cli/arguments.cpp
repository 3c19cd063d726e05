// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/arguments.h"

#include <CLI/CLI.hpp>

#include <optional>
#include <utility>

namespace toftwin::cli {

Argument& Argument::required(bool is_required) {
  option_->required(is_required);
  return *this;
}
Argument& Argument::showsDefault() {
  option_->capture_default_str();
  return *this;
}
Argument& Argument::describe(const std::string& help) {
  option_->description(help);
  return *this;
}
Argument& Argument::environment(const std::string& name) {
  option_->envname(name);
  return *this;
}

Argument& Argument::within(int least, int most) {
  option_->check(CLI::Range(least, most));
  return *this;
}
Argument& Argument::within(std::uint64_t least, std::uint64_t most) {
  option_->check(CLI::Range(least, most));
  return *this;
}
Argument& Argument::within(double least, double most) {
  option_->check(CLI::Range(least, most));
  return *this;
}
Argument& Argument::notNegative() {
  option_->check(CLI::NonNegativeNumber);
  return *this;
}
Argument& Argument::oneOf(const std::vector<std::string>& words) {
  option_->check(CLI::IsMember(words));
  return *this;
}
Argument& Argument::valid(std::function<std::string(const std::string&)> problem_of) {
  option_->check(std::move(problem_of));
  return *this;
}

Argument& Argument::values(int count) {
  option_->expected(count);
  return *this;
}
Argument& Argument::values(int least, int most) {
  option_->expected(least, most);
  return *this;
}
Argument& Argument::separatedBy(char separator) {
  option_->delimiter(separator);
  return *this;
}
Argument& Argument::oneAtATime() {
  option_->allow_extra_args(false);
  return *this;
}

Argument& Argument::needs(const Argument& other) {
  option_->needs(other.option_);
  return *this;
}
Argument& Argument::excludes(const Argument& other) {
  option_->excludes(other.option_);
  return *this;
}

template <class T>
Argument Arguments::option(const std::string& names, T& value, const std::string& help) {
  return Argument{app_.add_option(names, value, help)};
}
template <class T>
Argument Arguments::given(const std::string& names, std::function<void(const T&)> take, const std::string& help) {
  return Argument{app_.add_option_function<T>(names, take, help)};
}
Argument Arguments::flag(const std::string& names, bool& value, const std::string& help) {
  return Argument{app_.add_flag(names, value, help)};
}
Argument Arguments::declared(const std::string& name) { return Argument{app_.get_option(name)}; }

void Arguments::check(std::function<Result<>()> check) {
  app_.callback([check = std::move(check)] {
    if (const auto checked = check(); !checked) throw CLI::ValidationError{checked.error().message};
  });
}

template Argument Arguments::option(const std::string&, std::string&, const std::string&);
template Argument Arguments::option(const std::string&, int&, const std::string&);
template Argument Arguments::option(const std::string&, std::uint32_t&, const std::string&);
template Argument Arguments::option(const std::string&, std::uint64_t&, const std::string&);
template Argument Arguments::option(const std::string&, double&, const std::string&);
template Argument Arguments::option(const std::string&, std::optional<int>&, const std::string&);
template Argument Arguments::option(const std::string&, std::optional<double>&, const std::string&);
template Argument Arguments::option(const std::string&, std::optional<std::string>&, const std::string&);
template Argument Arguments::option(const std::string&, std::vector<std::string>&, const std::string&);
template Argument Arguments::option(const std::string&, std::vector<double>&, const std::string&);
template Argument Arguments::option(const std::string&, std::vector<std::uint32_t>&, const std::string&);
template Argument Arguments::given(const std::string&, std::function<void(const std::string&)>, const std::string&);
template Argument Arguments::given(const std::string&, std::function<void(const double&)>, const std::string&);

}  // namespace toftwin::cli
