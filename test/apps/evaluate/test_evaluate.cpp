#include "test/modules/sensors/euroc_folder.hpp"
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
  const Json plots = data_of_page(files.folder.read("out.html"), "plots")["charts"];
  REQUIRE(plots.size() == 1);
  CHECK(plots[0]["map"] == true);
  CHECK(plots[0]["series"].size() == 3);
}

TEST_CASE("Several truths belong to the estimates one by one") {
  const Files files;
  const std::string two = kTool + "trajectory --truth " + files.a + " --truth " + files.b;
  const auto result = run_command(two + " --estimate " + files.a + ' ' + files.b);
  CHECK(result.exit_code == 0);
  CHECK_THAT(result.output, Contains(" 0.0000"));
}

TEST_CASE("closures judges the folders of a run") {
  const EurocFolder recording;
  const Files files;
  const auto robot = [&](const std::string& id, const std::string& closures) {
    files.folder.write("r" + id + "/keyframes.csv",
                       "robot,keyframe,stamp_ns,median_depth_m\n" + id + ",0,105000000000,4\n");
    files.folder.write("r" + id + "/loop_closures.csv",
                       "from_robot,from_keyframe,to_robot,to_keyframe,similarity,stage,matches,"
                       "inliers,tx,ty,tz,qx,qy,qz,qw,s1,s2,s3,s4,s5,s6,reason\n" +
                           closures);
    return (files.folder.path() / ("r" + id)).string();
  };
  const std::string a =
      robot("1", "1,0,2,0,0.5,inlier,80,60,0.1,0,0,0,0,0,1,.1,.1,.1,.1,.1,.1,\"\"\n");
  const std::string b =
      robot("2", "2,0,1,0,0.5,inlier,80,60,0.9,0,0,0,0,0,1,.1,.1,.1,.1,.1,.1,\"\"\n");
  const std::string json = (files.folder.path() / "closures.json").string();
  const std::string command = kTool + "closures --dataset " + recording.root().string() +
                              " --truth " + files.truth + " --json " + json + " --results ";
  const auto result = succeeded(run_command(command + a + ' ' + b));
  CHECK_THAT(result.output, Contains("inliers          2     1              1      50.0%"));
  CHECK_THAT(files.folder.read("closures.json"), Contains("\"pair_recall\": 1"));
  CHECK_THAT(result.output,
             Contains("note: " + files.truth + " is taken for the true poses of robot 1 (" + a +
                      ") and of robot 2 (" + b + ") at the same times"));
  const auto own = files.folder.write("own.tum", "1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n").string();
  const auto apart = run_command(command + a + ' ' + b + " --truth " + own);
  CHECK_THAT(apart.output,
             Contains("note: none of the 1 keyframes of robot 2 (" + b + ") lies within " + own) &&
                 !Contains("at the same times"));
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
      {"closures --dataset . --truth " + files.truth + " --results /none",
       "kimera_multi_evaluate: /none/keyframes.csv: no such file\n"},
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
