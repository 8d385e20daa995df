#include "modules/evaluation/trajectory_report.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "test/modules/evaluation/trajectories.hpp"

namespace km {
namespace {

const std::vector<StampedPose> kTruth = sample(0.0, 20.0, 100, curve);
const std::vector<TrajectoryInput> kInputs = {{"alpha", kTruth, kTruth, {}},
                                              {"b<&>eta", kTruth, kTruth, {}}};

std::size_t count(const std::string& text, const std::string& word) {
  std::size_t n = 0;
  for (auto at = text.find(word); at != text.npos; at = text.find(word, at + 1)) ++n;
  return n;
}

}  // namespace

TEST_CASE("The table has a line per estimate and one for a team", "[evaluation]") {
  const std::string team = to_table(trajectory_error(kInputs));
  CHECK(count(team, "\n") == 5);
  CHECK_THAT(team, Catch::Contains("alpha") && Catch::Contains("\nteam"));
  CHECK_THAT(team, Catch::Contains("100.0%"));
  const std::string one = to_table(trajectory_error({kInputs.data(), 1}));
  CHECK(count(one, "\n") == 3);
  CHECK_THAT(one, !Catch::Contains("team"));
}

TEST_CASE("The JSON holds every robot and the team", "[evaluation]") {
  const std::string text = json_text(trajectory_error(kInputs));
  CHECK(count(text, "\"position_m\"") == 3);
  CHECK_THAT(text, Catch::Contains("\"name\": \"alpha\"") &&
                       Catch::Contains("\"completeness\": 1") && Catch::Contains("\"pairs\": 200"));
}

TEST_CASE("Relative errors of which there are none are not perfect", "[evaluation]") {
  TrajectoryErrorOptions options;
  options.rpe_delta_s = 100.0;  // the poses span 20 s
  const TeamError none = trajectory_error(kInputs, options);
  CHECK(none.joint.rpe_translation_m.count == 0);
  const std::string table = to_table(none);
  CHECK(count(table, "          -          -   100.0%\n") == 3);
  CHECK(count(table, "\n-: no two compared poses lie one delta apart") == 1);
  CHECK(count(to_table(trajectory_error(kInputs)), "no two compared poses") == 0);
  const std::string text = json_text(none.joint);
  CHECK(count(text, ": null") == 8);  // four figures of translation, four of rotation
  CHECK_THAT(text, !Catch::Contains("nan"));
}

TEST_CASE("The plot draws a shared truth once and every estimate", "[evaluation]") {
  const std::string svg = plot_from_above(kInputs, trajectory_error(kInputs));
  CHECK_THAT(svg, Catch::StartsWith("<svg ") && Catch::EndsWith("</svg>\n"));
  CHECK(count(svg, "stroke-linecap") == 3);
  CHECK_THAT(svg, Catch::Contains("alpha, position rmse") && Catch::Contains("b&lt;&amp;&gt;eta"));
  CHECK_THAT(svg, !Catch::Contains("nan") && !Catch::Contains("inf") && !Catch::Contains("e+"));
}

TEST_CASE("The plot leaves out the truth before and after the estimates", "[evaluation]") {
  const std::vector<StampedPose> part(kTruth.begin() + 40, kTruth.begin() + 60);
  const std::vector<TrajectoryInput> inputs = {{"part", kTruth, part, {}}};
  const std::string svg = plot_from_above(inputs, trajectory_error(inputs));
  const auto line = svg.find(" d=", svg.find("stroke-linecap"));
  const std::string truth = svg.substr(line, svg.find("/>", line) - line);
  CHECK(count(truth, ",") == part.size());  // one comma between x and y of a point
}

}  // namespace km
