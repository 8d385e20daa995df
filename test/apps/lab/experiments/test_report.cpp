#include <catch2/catch.hpp>
#include <limits>
#include <string>
#include <vector>

#include "apps/lab/experiments/report.hpp"
#include "apps/lab/experiments/report_document.hpp"
#include "test/apps/lab/experiments/canned_city.hpp"
#include "test/support/page_text.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

using Catch::Contains;

// Every element of a page that is written as XML is closed, in order; styles, scripts and the first
// line are left out.
bool is_balanced(const std::string& page) {
  std::vector<std::string> open;
  for (std::size_t at = page.find('<'); at != page.npos; at = page.find('<', at + 1)) {
    const std::size_t end = page.find('>', at);
    if (end == page.npos) return false;
    if (page[at + 1] == '!') continue;
    const bool closing = page[at + 1] == '/';
    const std::size_t name_at = at + (closing ? 2 : 1);
    const std::string name = page.substr(name_at, page.find_first_of(" />\n", name_at) - name_at);
    if (name == "script") {
      at = page.find("</script>", end);
    } else if (closing) {
      if (open.empty() || open.back() != name) return false;
      open.pop_back();
    } else if (page[end - 1] != '/') {
      open.push_back(name);
    }
  }
  return open.empty();
}

TEST_CASE("The report has errors, closures and recall by angle of the levels of difficulty",
          "[experiments]") {
  const CannedCity city;
  const ReportSummary summary = city.report();
  CHECK(summary.targets > 0);
  const std::string text = city.read("report.md");
  // Odometry errs by 0.1 x: 0.1118 m rms about its mean, and 0.1085 m after the best rotation of
  // all robots together.
  CHECK_THAT(text, Contains("| City, level 2, seed 1 | 1 of 1 | 0.012 (0.012 to 0.012) | 0.108 | "
                            "0.006 | 817 | 1 | 0.00 | 37500 | 0 |"));
  CHECK_THAT(text, Contains("| level | 0 to 30 degrees |") &&
                       Contains("| 2 | - | - | 40.0% of 10 | - | - | - |"));
  CHECK_THAT(text, Contains("| false closures kept | level 2 | 0 | **1** |") &&
                       Contains("| runs in which all robots joined | level 2 | 1 of 1 |") &&
                       Contains("at most 0.006 m, half of the median odometry ATE"));
}

TEST_CASE("The report has every table with our values and the paper's", "[experiments]") {
  const CannedCity city;
  const ReportSummary summary = city.report();
  CHECK(summary.targets > 8);
  CHECK(summary.met < summary.targets);
  const std::string text = city.read("report.md");
  CHECK_THAT(text, Contains("Table I: absolute trajectory error") && Contains("Table I: cost") &&
                       Contains("Table II: communication") &&
                       Contains("Table II: rounds and seconds") && Contains("Fig. 7 as numbers") &&
                       Contains("Table III") && Contains("Fig. 5 as numbers") &&
                       Contains("Numbers to reach"));
  // Costs 1060 over 1000 in their cells beside the paper's, and the gap between them.
  CHECK_THAT(text, Contains("1060.0 (1113.1)") && Contains("| 6.0 (6.3) |"));
  // The bend is such that no rigid motion reduces the error. Half of the error is less than the
  // paper's share.
  CHECK_THAT(text, Contains("1.00 (6.09)") && Contains("0.500 (2.38)"));
  // Published by default and by the paper's pipeline, which is no repetition.
  CHECK_THAT(text,
             Contains("| City | 0.00600 | 0.00800 | 0.009 | 1.00 (6.09) |") &&
                 Contains("| ATE of what the robots published over that of local PGO | City | "
                          "at most 0.39, the paper's | **0.01 (0.01 to 0.01 in 3 runs)** |"));
  CHECK_THAT(text, Contains("| ATE of RBCD over that of local PGO | City | at most 0.39, the "
                            "paper's | **0.56 (0.50 to 0.62 in 3 runs)** |"));
  // 12 keyframes of 40 kB; 3 + 6 + 4.321 MB sent.
  CHECK_THAT(text, Contains("| 12 (3238) | 34 (3428) | 3.00 (16.43) | 6.00 (36.80) | 4.32 (4.27) | "
                            "13.32 (57.50) | 2.2 (1989.4) | 0.48 (149.48) | 2775 (38) |"));
  CHECK_THAT(text, Contains("| 5 (500) | 0.125 (34.90) |") && Contains("| 7 | 0.500 |"));
  CHECK_THAT(text, Contains("| City, merged | 8.00 | **6.00** | 4.00 | **3.00** |"));
  CHECK_THAT(text, Contains("| City, merged | 90.00 (67.91) | **95.00** (83.93) |"));
  CHECK_THAT(text, Contains("| robot0, odometry alone | no | 3 | 0.6 | 0.20 | 120 |") &&
                       Contains("| City, robot0 | no | 3 | 2.4 | 0.80 | 250 |") &&
                       Contains("| vio | 75.0 | 100.0 |"));
  CHECK_THAT(
      text,
      Contains("`kimera_multi_pgo ") &&
          Contains("All on TestChip, 2 cores, 8 GB; commit abc123.") &&
          Contains(
              "`kimera_multi_pgo solve RESULTS/graphs/city --method local --no-vertical --json ") &&
          Contains("12.5 s, load 0.5"));
  // Closures lost and kept, errors, ratio, published errors, rounds and seconds of COSMO-Bench.
  CHECK_THAT(text, Contains("| kth_r3_00, Wi-Fi | 1604 | 1 of 100 | 1 of 100 | 0 of 20 | 2 of 20 | "
                            "1.50 | 2.00 | 0.75 | 1.77 | 1.79 | 1 | 0.250 |") &&
                       Contains("| ATE on COSMO-Bench | kth_r3_00, Wi-Fi | at most 1.77 m, the "
                                "best published | **1.50 m** |"));
  // Several runs and seeds by median and range.
  CHECK_THAT(text,
             Contains("| City | 3 | 0.0060 (0.0060 to 0.0060) | 0.9000 (0.8000 to 1.0000) | 0.5000 "
                      "(0.5000 to 0.5000) |"));
  CHECK_THAT(text, Contains("| City | 3 | 3.00 (3.00 to 3.00) | 6.00 (6.00 to 6.00) | 27.00 "));
  CHECK_THAT(text, Contains("| 120 | 8.000 (4.000 to 12.000) | 1.000 (1.000 to 1.000) |"));
  CHECK_THAT(text, Contains("3 seeds, the worst | faster | **4.0 times as fast** |"));
  // 36 MB over 12 keyframes of 40 kB.
  CHECK_THAT(
      text,
      Contains("keypoints sent, one solve, as the paper counts | City | at most 38 %, aim 10 % | "
               "**2775 % (2775 to 2775 in 3 runs)** |") &&
          Contains("keypoints sent, all solves of the run | City | at most 38 % | **7500 % (7500 "
                   "to 7500 in 3 runs)** |") &&
          // Keyframes with 200 keypoints have a fifth of the bytes.
          Contains("as many keypoints as robots receive, all of the run | City | at most 38 %, aim "
                   "10 % | **37500 % (37500 to 37500 in 3 runs)** |"));
}

TEST_CASE("A robot that never met the others is named", "[experiments]") {
  const CannedCity city;
  Json team = Json::parse(city.read("team-city.json"));
  team["robots"][2]["in_team_frame"] = false;
  city.write("team-city.json", json_text(team));
  (void)city.report();
  CHECK_THAT(city.read("report.md"), Contains("City: robot2 never met the others;"));
}

TEST_CASE("Small versions are judged only by targets that they can decide", "[experiments]") {
  const CannedCity city(true);
  const ReportSummary summary = city.report();
  CHECK(summary.targets == 6);  // a cost, COSMO-Bench, two searches with time and clique
  CHECK(summary.met == 6);
  const std::string text = city.read("report.md");
  CHECK_THAT(text, Contains("6 of 6 are met.") && Contains("Not judged: inputs of full size") &&
                       Contains("| ATE of RBCD over that of local PGO | City | at most 0.39, the "
                                "paper's | 0.56 (0.50 to 0.62 in 3 runs) |") &&
                       !Contains("**Missed**"));
}

TEST_CASE("The page stands alone and is well formed", "[experiments]") {
  const CannedCity city;
  (void)city.report();
  const std::string page = city.read("report.html");
  CHECK(is_balanced(page));
  CHECK(occurrences(page, "http") == 0);
  const Json plots = data_of_page(page, "plots");
  CHECK(plots.size() == 4);  // outlier rejection, two trajectories, mesh errors
  for (const auto& [id, drawn] : plots.items()) CHECK(occurrences(page, " id=\"" + id + '"') == 1);
  CHECK(occurrences(page, "data:image/png;base64,") == 2);
  for (const char* id : {"targets", "pcm", "cosmo", "trajectory", "resources", "mesh", "semantics",
                         "levels", "origin"}) {
    CAPTURE(id);
    CHECK_THAT(page, Contains("<section id=\"" + std::string(id) + "\">") &&
                         Contains("<a href=\"#" + std::string(id) + "\">"));
  }
  CHECK_THAT(page, Contains("<td>1060.0<span class=\"paper\">1113.1</span></td>"));
  CHECK_THAT(city.read("numbers.json"), Contains("\"paper\": \"1113.1\""));
}

TEST_CASE("Without results the report states that there are none", "[experiments]") {
  const CannedCity city;
  city.forget("pgo-city-rbcd");
  for (const char* step : {"pcm-1", "pcm-2", "pcm-3"}) city.forget(step);
  (void)city.report();
  std::string text = city.read("report.md");
  CHECK_THAT(text, !Contains("1060.0 (1113.1)") && Contains("- (1113.1)") &&
                       !Contains("Outlier rejection") && Contains("No results so far: pcm.") &&
                       Contains("Not done: pcm-1, pcm-2, pcm-3 (no pose graph ") &&
                       Contains("Not done: pgo-city-rbcd (not run, or not up to date)."));
  for (const char* step : {"team-city", "alone-city", "team-level2-city-seed1"}) city.forget(step);
  city.forget_cosmo();
  (void)city.report();
  text = city.read("report.md");
  CHECK_THAT(text, !Contains("Table I:") && !Contains("Table III") && !Contains("## Meshes") &&
                       Contains("Nothing was measured yet."));
}

TEST_CASE("A spread is median, lowest and highest of the finite values", "[experiments]") {
  const Spread spread = spread_of({3.0, 1.0, std::numeric_limits<double>::quiet_NaN(), 2.0, 10.0});
  CHECK(spread.count == 4);
  CHECK(spread.median == 2.5);
  CHECK(spread.lowest == 1.0);
  CHECK(spread.highest == 10.0);
  CHECK(spread_of({}).count == 0);
}

TEST_CASE("A range is shown if there are several values", "[experiments]") {
  const ReportCell several = spread_cell(spread_of({1.0, 2.0, 4.0}), 1);
  CHECK(several.text == "2.0");
  CHECK(several.paper == "1.0 to 4.0");
  const ReportCell one = spread_cell(spread_of({1.0}), 2);
  CHECK(one.text == "1.00");
  CHECK(one.paper.empty());
  CHECK(spread_cell({}, 2).text == "-");
}

ReportDocument document_with(ReportBlock block) {
  ReportDocument document{.title = "T", .lead = "L", .sections = {}};
  document.sections.push_back({.id = "s", .title = "S", .blocks = {}});
  document.sections[0].blocks.push_back(std::move(block));
  return document;
}

TEST_CASE("A table has groups, our values and the paper's", "[experiments]") {
  const ReportDocument document = document_with(ReportTable{
      .caption = "C",
      .groups = {{"", 1}, {"g", 2}},
      .columns = {"world", "x", "y"},
      .rows = {{{"a|b"}, {"1", "2"}, {.text = "3", .style = ReportCell::Style::kBest}}}});
  CHECK_THAT(to_html(document), Contains("<th class=\"group\" colspan=\"2\">g</th>") &&
                                    Contains("<td>1<span class=\"paper\">2</span></td>") &&
                                    Contains("<td class=\"best\">3</td>"));
  CHECK_THAT(to_markdown(document), Contains("| world | g: x | g: y |\n| --- | ---: | ---: |\n"
                                             "| a\\|b | 1 (2) | **3** |"));
}

TEST_CASE("Pictures are in the page itself", "[experiments]") {
  const TemporaryFolder folder;
  const auto png = folder.write("p.png", "\x89PNG");
  const std::string page = to_html(
      document_with(ReportFigures{{{.name = "a", .caption = "drawn", .plots = {Plot{.title = "p"}}},
                                   {.name = "b", .caption = "taken", .png = png}}}));
  CHECK(data_of_page(page, "plots")["figure-a"][0]["title"] == "p");
  CHECK_THAT(page, Contains("<div class=\"plots\" id=\"figure-a\"></div>") &&
                       Contains("src=\"data:image/png;base64,iVBORw==\""));
  CHECK_THROWS_WITH(
      to_html(document_with(ReportFigures{{{.name = "c", .caption = "", .png = "no.png"}}})),
      Contains("no.png"));
}

TEST_CASE("Text is escaped", "[experiments]") {
  CHECK_THAT(to_html(document_with(ReportParagraph{"a < b & c"})), Contains("a &lt; b &amp; c"));
}

}  // namespace
}  // namespace km
