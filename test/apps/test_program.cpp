#include "apps/program_options.hpp"
#include "test/modules/sensors/euroc_folder.hpp"
#include "test/support/command.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

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

Parsed parse(CLI::App& app, std::vector<const char*> words, const std::string& hint = {}) {
  words.insert(words.begin(), "program");
  const CapturedErrors errors;
  const auto exit_code = parse_options(app, static_cast<int>(words.size()), words.data(), hint);
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

struct CountCommand {
  void define(CLI::App& /*app*/) {}
  void run() { ++commands_run; }
};

void add_count(CLI::App& parent) {
  add_command<CountCommand>(parent, "count", "Counts\nin the second line");
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

TEST_CASE("An invalid command line gives the exit code and a message with the option") {
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
  CHECK(parsed.exit_code == kBadCommandLine);
  CHECK_THAT(parsed.errors, Contains(named));
  CHECK_THAT(parsed.errors, Contains("NAME") || !Contains("is required"));
}

TEST_CASE("A callback can refuse its option, or end the program") {
  Program program;
  program.app.add_flag_callback(
      "--refused", [] { throw CLI::ValidationError("--refused", "why"); }, "");
  program.app.add_flag_callback(
      "--done", [] { throw CLI::Success(); }, "");
  CHECK_FALSE(parse(program.app, {"a", "--number", "2"}).exit_code);
  CHECK(program.number == 2);
  const Parsed refused = parse(program.app, {"a", "--refused"});
  CHECK(refused.exit_code == kBadCommandLine);
  CHECK_THAT(refused.errors, StartsWith("--refused: why\n"));
  const Parsed done = parse(program.app, {"a", "--done"});
  CHECK(done.exit_code == 0);
  CHECK(done.errors.empty());
}

TEST_CASE("A subcommand runs once and its failure is the program's") {
  commands_run = 0;
  CHECK(run_program({"count"}).exit_code == 0);
  CHECK(commands_run == 1);
  const Parsed failed = run_program({"fail"});
  CHECK(failed.exit_code == 1);
  CHECK(failed.errors == "program: no file\n");
}

TEST_CASE("Without a subcommand the program lists them") {
  const std::vector<std::string> words =
      GENERATE(std::vector<std::string>{}, std::vector<std::string>{"cont"});
  const Parsed parsed = run_program(words);
  CHECK(parsed.exit_code == kBadCommandLine);
  CHECK_THAT(parsed.errors, EndsWith("program: the first word must be a subcommand:\n"
                                     "  count  Counts\n  fail  Fails\n"));
}

TEST_CASE("Every program has one exit code for bad command lines") {
  const std::multimap<std::string, std::string> more = {
      {"kimera_multi_robot", "--robot 0 --graph x --output x --set no.key=1"},
      {"kimera_multi_robot", "--robot 0 --graph x --output x --set pcm"},
      {"kimera_multi_robot", "--robot 0 --graph x --output x --from 3"},
      {"kimera_multi_robot", "--robot 0 --graph x --output x --record-images"},
      {"kimera_multi_robot", "--robot 0 --live README.md --output x --rate 2"},
      {"kimera_multi_keys", "make x --robots beta"},
      {"kimera_multi_keys", "make x --robots beta:1,gamma:1"},
      {"kimera_multi_evaluate", "render --mesh x --output x.png --view foo"},
      {"kimera_multi_simulate", "--config config/simulation/city.yaml --robots 0 --output x"},
      {"kimera_multi_simulate", "--world city --names a --output x"}};
  for (const std::string& name : words_of(KM_PROGRAMS)) {
    std::vector<std::string> lines = {"", "--nosuch"};
    for (const auto& [program, line] : more)
      if (program == name) lines.push_back(line);
    for (const std::string& line : lines) {
      const CommandResult result = run_command(KM_BIN_DIR "/" + name + ' ' + line);
      CAPTURE(name, line, result.output);
      CHECK(result.exit_code == kBadCommandLine);
      CHECK(is_refused(result));
    }
  }
}

// The exit code of the doctor is the severity of its findings.
TEST_CASE("An input that is missing or unreadable gives the exit code of bad input") {
  const EurocFolder recording;
  const TemporaryFolder folder;
  std::map<std::string, std::string> values = {
      {"DATA", recording.root()},
      {"OUT", folder.path() / "out"},
      {"TRUTH", folder.write("truth.tum", "1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n3 2 0 0 0 0 0 1\n")},
      {"PLAY", "robot --robot 0 --interface lo --output OUT --dataset DATA"},
      {"TEAM", "team --config config/teams/euroc_two_robots.yaml --dataset DATA --output OUT"}};
  const std::string garbage = folder.write("garbage", "\1\2");
  std::vector<std::string> lines = {
      "robot --robot 0 --dataset DATA --resume INPUT",
      "robot --inspect INPUT",
      "robot --config INPUT --print-config",
      "doctor INPUT",
      "doctor DATA --rig INPUT",
      "doctor --live INPUT",
      "team --config INPUT --output OUT",
      "TEAM --links INPUT",
      "TEAM --security INPUT",
      "evaluate trajectory --truth INPUT --estimate TRUTH",
      "evaluate trajectory --truth TRUTH --estimate INPUT",
      "evaluate consistency --results INPUT --truth TRUTH",
      "evaluate mesh --truth INPUT --estimate INPUT",
      "evaluate objects --truth INPUT --estimate INPUT",
      "evaluate render --mesh INPUT --output OUT.png",
      "evaluate glb --mesh INPUT --output OUT.glb",
      "keys add INPUT --robots a:0",
      "keys revoke INPUT a",
      "publish DATA --interface lo --fixes INPUT",
      "viewer --domain 7 --interface lo --palette INPUT",
      "vocabulary train INPUT -o OUT.kmvoc",
      "simulate --config INPUT --output OUT",
      "simulate --world vicon_room --trajectory INPUT --imu INPUT --output OUT"};
  for (const std::string& option : words_of("dataset graph session live"))
    lines.push_back("robot --robot 0 --output OUT --" + option + " INPUT");
  for (const std::string& option : words_of("localize extend odometry rig config security link"))
    lines.push_back("PLAY --" + option + " INPUT");
  for (const char* program :
       {"publish", "viewer", "keys show", "pgo solve", "pgo pcm", "pgo outliers"})
    lines.push_back(program + std::string(" INPUT"));
  for (const std::string& line : lines)
    for (const std::string& input : {std::string("/nowhere"), garbage}) {
      values["INPUT"] = input;
      std::string words = line;
      for (const char* name : {"PLAY", "TEAM", "DATA", "TRUTH", "OUT", "INPUT"})
        for (std::size_t at = 0; (at = words.find(name)) != words.npos;)
          words.replace(at, std::strlen(name), values.at(name));
      const std::string program = "kimera_multi_" + words.substr(0, words.find(' '));
      if (std::ranges::count(words_of(KM_PROGRAMS), program) == 0) continue;  // not in this build
      const CommandResult result = run_command(KM_BIN_DIR "/kimera_multi_" + words);
      CAPTURE(words, result.output);
      CHECK(result.exit_code == (words.starts_with("doctor") ? 2 : kBadInput));
      CHECK_THAT(result.output, Contains(input) && !Contains("Run with --help"));
    }
  CHECK_THAT(run_command(KM_BIN_DIR "/kimera_multi_team --config no_team").output,
             Contains("no file no_team") && Contains("euroc_two_robots"));  // shipped names
}

namespace {

constexpr const char* kCommitPattern = "(unknown|[0-9a-f]{10,40}(-dirty)?)";

}  // namespace

TEST_CASE("Every program prints its version, its commit and its build settings") {
  std::istringstream programs(KM_PROGRAMS);  // all of this build
  int count = 0;
  for (std::string name; programs >> name; ++count) {
    CAPTURE(name);
    const CommandResult result = run_command(KM_BIN_DIR "/" + name + " --version");
    CHECK(result.exit_code == 0);
    CHECK_THAT(result.output, Matches(name + " " KM_VERSION "\ncommit " + kCommitPattern +
                                      "\nbuilt with [A-Za-z]+ [0-9.]+, [A-Za-z]+, "
                                      "Cyclone DDS [0-9.]+, Eigen [0-9.]+, "
                                      "OpenCV [0-9.]+, Ceres [0-9.]+\n"));
  }
  CHECK(count >= 9);  // without simulator and viewer
}

namespace {

// Sources in a folder, and the commit that the build finds for them.
struct Sources {
  TemporaryFolder folder;

  Sources() { folder.write("tree/CMakeLists.txt", "one"); }
  CommandResult git(const std::string& arguments) const {
    return run_command("git -C " + folder.path().string() +
                       "/tree -c user.name=a -c user.email=a@b " + arguments);
  }
  void commit() const {
    REQUIRE(git("init -q").exit_code == 0);
    REQUIRE(git("add CMakeLists.txt").exit_code == 0);
    REQUIRE(git("commit -q -m one").exit_code == 0);
  }
  // As found in the subfolder `tree`.
  std::string found(const std::string& tree = "tree") const {
    const std::string root = folder.path().string() + '/';
    // The folder for temporary files may be below a repository.
    const CommandResult result =
        succeeded(run_command("GIT_CEILING_DIRECTORIES=" + root + " cmake -DSOURCE=" + root + tree +
                              " -DOUTPUT=" + root + "commit.hpp -P apps/write_commit.cmake"));
    const std::string header = folder.read("commit.hpp");
    const std::size_t begin = header.find('"') + 1;
    return header.substr(begin, header.find('"', begin) - begin);
  }
};

}  // namespace

TEST_CASE("The build knows the commit of its sources, and whether they differ") {
  const Sources sources;
  CHECK(sources.found() == "unknown");
  if (run_command("git --version").exit_code != 0) {
    WARN("SKIPPED: no git");
    return;
  }
  sources.commit();
  const std::string commit = sources.found();
  CHECK_THAT(commit, Matches("[0-9a-f]{10,40}"));
  sources.folder.write("tree/build/x.o", "not tracked");
  CHECK(sources.found() == commit);
  sources.folder.write("tree/CMakeLists.txt", "two");
  CHECK(sources.found() == commit + "-dirty");
  // A release below the repository of another project does not take its commit.
  sources.folder.write("tree/release/CMakeLists.txt", "one");
  CHECK(sources.found("tree/release") == "unknown");
}

TEST_CASE("The header of an unchanged commit is not written again") {
  const Sources sources;
  static_cast<void>(sources.found());
  const auto header = sources.folder.path() / "commit.hpp";
  const auto written = fs::file_time_type{};
  fs::last_write_time(header, written);
  static_cast<void>(sources.found());
  CHECK(fs::last_write_time(header) == written);
}

}  // namespace km
