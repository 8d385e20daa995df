#include "test/support/command.hpp"
#include "test/support/page_text.hpp"
#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {
namespace {

const std::string kTool = std::string(KM_BIN_DIR) + "/kimera_multi_evaluate ";

// A curve at 10 Hz over `from` to `to` [s], `lift` too high.
std::string tum(int from, int to, double lift) {
  std::string text = "# t x y z qx qy qz qw\n";
  for (int i = 10 * from; i <= 10 * to; ++i) {
    const double t = 0.1 * i;
    text += std::to_string(100.0 + t) + ' ' + std::to_string(std::sin(t)) + ' ' +
            std::to_string(std::cos(0.8 * t)) + ' ' + std::to_string(lift) + " 0 0 0 1\n";
  }
  return text;
}

struct Files {
  TemporaryFolder folder;
  std::string truth = folder.write("truth.txt", tum(0, 20, 0.0)).string();
  std::string a = folder.write("a/optimized.tum", tum(0, 10, 0.0)).string();
  std::string b = folder.write("b/optimized.tum", tum(10, 20, 1.0)).string();
};

}  // namespace

TEST_CASE("trajectory prints a table and writes JSON and a plot") {
  const Files files;
  const std::string json = (files.folder.path() / "out.json").string();
  const std::string plot = (files.folder.path() / "out.html").string();
  const auto result =
      succeeded(run_command(kTool + "trajectory --truth " + files.truth + " --estimate " + files.a +
                            ' ' + files.b + " --json " + json + " --plot " + plot));
  CHECK_THAT(result.output, Contains("a/optimized") && Contains("b/optimized") &&
                                Contains("\nteam") && Contains(" 50.0%"));
  CHECK_THAT(files.folder.read("out.json"), Contains("\"joint\""));
  CHECK(data_of_page(files.folder.read("out.html"), "plot")["series"].size() == 3);
}

TEST_CASE("Several truths belong to the estimates one by one") {
  const Files files;
  const std::string two = kTool + "trajectory --truth " + files.a + " --truth " + files.b;
  const auto result = run_command(two + " --estimate " + files.a + ' ' + files.b);
  CHECK(result.exit_code == 0);
  CHECK_THAT(result.output, Contains(" 0.0000"));
}

TEST_CASE("Bad input is refused and named") {
  const Files files;
  const std::string bad = files.folder.write("bad.tum", "1.0 0 0 0 0 0 0 1\nhello\n").string();
  const std::string rest = " --estimate " + files.a;
  const std::string good = "trajectory --truth " + files.truth;
  const std::vector<std::pair<std::string, std::string>> refused = {
      {"trajectory --truth " + bad + rest, "bad.tum line 2: 1 fields, expected 8"},
      {good + rest + " --plot x.svg", "x.svg: --plot writes *.html"},
      {good + " --truth " + files.b + rest, "give one --truth"},
      {"consistency --truth " + files.truth + " --results /none", "kimera_multi_evaluate: /none/"},
      {good, "--estimate is required"},
      {"", "subcommand is required"},
      {"bogus", "bogus"},
      {"trajectory --bogus", "--bogus"}};
  for (const auto& [arguments, message] : refused) {
    const auto result = run_command(kTool + arguments);
    CAPTURE(arguments);
    CHECK(is_refused(result));
    CHECK_THAT(result.output, Contains(message));
  }
  const auto help = run_command(kTool + "trajectory --help");
  CHECK(help.exit_code == 0);
  CHECK_THAT(help.output, Contains("Examples:"));
}

}  // namespace km
