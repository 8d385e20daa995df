#include <catch2/catch.hpp>
#include <iostream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "apps/program_options.hpp"

namespace km {
namespace {

// Collects what is written to std::cerr.
class CapturedErrors {
 public:
  CapturedErrors() : before_(std::cerr.rdbuf(text_.rdbuf())) {}
  ~CapturedErrors() { std::cerr.rdbuf(before_); }
  CapturedErrors(const CapturedErrors&) = delete;
  CapturedErrors& operator=(const CapturedErrors&) = delete;
  [[nodiscard]] std::string text() const { return text_.str(); }

 private:
  std::ostringstream text_;
  std::streambuf* before_;
};

struct Parsed {
  std::optional<int> exit_code;
  std::string errors;
};

constexpr int kWrong = 7;

Parsed parse(CLI::App& app, std::vector<const char*> words, const std::string& hint = {}) {
  words.insert(words.begin(), "program");
  const CapturedErrors errors;
  const auto exit_code =
      parse_options(app, static_cast<int>(words.size()), words.data(), kWrong, hint);
  return {exit_code, errors.text()};
}

// A program with a positional argument and an option.
struct Program {
  CLI::App app{"About it.", "program"};
  std::string name;
  int number = 3;

  Program() {
    app.add_option("NAME", name, "A name")->required();
    app.add_option("--number", number, "A number")->check(CLI::Range(0, 9));
  }
};

int commands_run = 0;

void add_count(CLI::App& parent) {
  parent.add_subcommand("count", "Counts\nin the second line")->callback([] { ++commands_run; });
}

void add_failure(CLI::App& parent) {
  parent.add_subcommand("fail", "Fails")->callback([] { throw std::runtime_error("no file"); });
}

Parsed run_program(std::vector<std::string> words) {
  words.insert(words.begin(), "program");
  std::vector<char*> argv;
  argv.reserve(words.size());
  for (std::string& word : words) argv.push_back(word.data());
  const CapturedErrors errors;
  const int exit_code = run_subcommands("program", "About it.", {add_count, add_failure},
                                        static_cast<int>(argv.size()), argv.data());
  return {exit_code, errors.text()};
}

}  // namespace

TEST_CASE("An invalid command line gives the exit code and a message with the option",
          "[program]") {
  const std::string hint = "Options of others come after --\n";
  const auto [words, named] = GENERATE_COPY(table<std::vector<const char*>, std::string>({
      {{"a", "--number", "10"}, "--number: Value 10 not in range 0 to 9"},
      {std::vector<const char*>(), "NAME is required"},
      {{"a", "more"}, "more\nRun with --help for more information.\n" + hint},
      {{"--nmber"}, "--nmber"},  // and not that NAME is missing
  }));
  Program program;
  const Parsed parsed = parse(program.app, words, hint);
  CAPTURE(parsed.errors);
  CHECK(parsed.exit_code == kWrong);
  CHECK_THAT(parsed.errors, Catch::Contains(named));
  CHECK_THAT(parsed.errors, Catch::Contains("NAME") || !Catch::Contains("is required"));
}

TEST_CASE("A callback can refuse its option, or end the program", "[program]") {
  Program program;
  program.app.add_flag_callback(
      "--refused", [] { throw CLI::ValidationError("--refused", "why"); }, "");
  program.app.add_flag_callback(
      "--done", [] { throw CLI::Success(); }, "");
  CHECK_FALSE(parse(program.app, {"a", "--number", "2"}).exit_code);
  CHECK(program.number == 2);
  const Parsed refused = parse(program.app, {"a", "--refused"});
  CHECK(refused.exit_code == kWrong);
  CHECK_THAT(refused.errors, Catch::StartsWith("--refused: why\n"));
  const Parsed done = parse(program.app, {"a", "--done"});
  CHECK(done.exit_code == 0);
  CHECK(done.errors.empty());
}

TEST_CASE("A subcommand runs once and its failure is the program's", "[program]") {
  commands_run = 0;
  CHECK(run_program({"count"}).exit_code == 0);
  CHECK(commands_run == 1);
  const Parsed failed = run_program({"fail"});
  CHECK(failed.exit_code == 1);
  CHECK(failed.errors == "program: no file\n");
}

TEST_CASE("Without a subcommand the program lists them", "[program]") {
  const std::vector<std::string> words =
      GENERATE(std::vector<std::string>{}, std::vector<std::string>{"cont"});
  const Parsed parsed = run_program(words);
  CHECK(parsed.exit_code == 1);
  CHECK_THAT(parsed.errors, Catch::EndsWith("program: the first word must be a subcommand:\n"
                                            "  count  Counts\n  fail  Fails\n"));
}

}  // namespace km
