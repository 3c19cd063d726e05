// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <toftwin/result.h>

namespace CLI {
class App;
class Option;
}  // namespace CLI

/// What a subcommand says of its options: CLI11 in so many words. CLI11 is headers only, and compiling
/// them takes five seconds in each file that includes them; this way three do.
namespace toftwin::cli {

/// An option that was declared, to be told more about.
class Argument {
 public:
  explicit Argument(CLI::Option* option) : option_(option) {}

  Argument& required(bool is_required = true);
  Argument& showsDefault();  ///< --help says the value that the variable has now
  Argument& describe(const std::string& help);
  Argument& environment(const std::string& name);  ///< what it is taken from if it is not given

  Argument& within(int least, int most);
  Argument& within(std::uint64_t least, std::uint64_t most);
  Argument& within(double least, double most);
  Argument& notNegative();
  Argument& oneOf(const std::vector<std::string>& words);
  /// `problem_of` says what is wrong with a text, or nothing.
  Argument& valid(std::function<std::string(const std::string&)> problem_of);

  Argument& values(int count);
  Argument& values(int least, int most);
  Argument& separatedBy(char separator);
  Argument& oneAtATime();  ///< not several words after one option

  Argument& needs(const Argument& other);
  Argument& excludes(const Argument& other);

 private:
  CLI::Option* option_;
};

/// The options of one subcommand.
class Arguments {
 public:
  explicit Arguments(CLI::App& app) : app_(app) {}

  /// An option "-o,--output", or without dashes one that goes by its place. What is given comes into
  /// `value`, which must live until the command has run. For T see the end of arguments.cpp.
  template <class T>
  Argument option(const std::string& names, T& value, const std::string& help);
  /// The same; what is given goes to `take`. T is std::string or double.
  template <class T>
  Argument given(const std::string& names, std::function<void(const T&)> take, const std::string& help);
  Argument flag(const std::string& names, bool& value, const std::string& help);

  /// One that was declared before.
  Argument declared(const std::string& name);
  /// Has `check` called when the command line is read; its error is one of usage (Exit::Usage).
  void check(std::function<Result<>()> check);

 private:
  CLI::App& app_;
};

}  // namespace toftwin::cli
