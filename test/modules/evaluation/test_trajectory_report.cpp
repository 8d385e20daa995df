#include "modules/evaluation/trajectory_error.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "test/modules/evaluation/trajectories.hpp"
#include "test/support/page_text.hpp"

namespace km {
namespace {

const std::vector<StampedPose> kTruePoses = sample(0.0, 20.0, 100, curve);
const std::vector<TrajectoryInput> kInputs = {{"alpha", kTruePoses, kTruePoses, {}},
                                              {"b<&>eta", kTruePoses, kTruePoses, {}}};

}  // namespace

TEST_CASE("The table has a line per estimate and one for a team, the JSON an object",
          "[evaluation]") {
  const std::string team = to_table(trajectory_error(kInputs));
  CHECK(occurrences(team, "\n") == 5);
  CHECK_THAT(team, Catch::Contains("alpha") && Catch::Contains("\nteam"));
  CHECK_THAT(team, Catch::Contains("100.0%"));
  const std::string one = to_table(trajectory_error({kInputs.data(), 1}));
  CHECK(occurrences(one, "\n") == 3);
  CHECK_THAT(one, !Catch::Contains("team"));
  const std::string json = json_text(trajectory_error(kInputs));
  CHECK(occurrences(json, "\"position_m\"") == 3);
  CHECK_THAT(json, Catch::Contains("\"name\": \"alpha\"") &&
                       Catch::Contains("\"completeness\": 1") && Catch::Contains("\"pairs\": 200"));
}

TEST_CASE("Missing relative errors are not perfect errors", "[evaluation]") {
  TrajectoryErrorOptions options;
  options.rpe_delta_s = 100.0;  // the poses span 20 s
  const TeamError none = trajectory_error(kInputs, options);
  CHECK(none.joint.rpe_translation_m.count == 0);
  const std::string table = to_table(none);
  CHECK(occurrences(table, "          -          -   100.0%\n") == 3);
  CHECK(occurrences(table, "\n-: no two compared poses lie one delta apart") == 1);
  CHECK(occurrences(to_table(trajectory_error(kInputs)), "no two compared poses") == 0);
  const std::string text = json_text(none.joint);
  CHECK(occurrences(text, ": null") == 8);  // four figures of translation, four of rotation
  CHECK_THAT(text, !Catch::Contains("nan"));
}

TEST_CASE("The plot draws a shared truth once and every estimate", "[evaluation]") {
  const Plot plot = plot_from_above(kInputs, trajectory_error(kInputs));
  CHECK(plot.is_map);
  REQUIRE(plot.series.size() == 3);
  CHECK(plot.series[0].name == "truth");
  CHECK(plot.series[0].colour == PlotSeries::kGrey);
  CHECK_THAT(plot.series[1].name, Catch::StartsWith("alpha, position rmse "));
  CHECK_THAT(plot.series[2].name, Catch::StartsWith("b<&>eta, position rmse "));
  CHECK(plot.series[1].colour != plot.series[2].colour);
  constexpr double kRounding_m = 1e-9;
  for (const PlotSeries& series : plot.series) {
    REQUIRE(series.points.size() == kTruePoses.size());
    for (std::size_t i = 0; i < kTruePoses.size(); ++i) {
      CHECK(series.points[i].x == Approx(kTruePoses[i].T.translation().x()).margin(kRounding_m));
      CHECK(series.points[i].y == Approx(kTruePoses[i].T.translation().y()).margin(kRounding_m));
    }
  }
  // The truth before and after the estimates is left out.
  const std::vector<StampedPose> part(kTruePoses.begin() + 40, kTruePoses.begin() + 60);
  const std::vector<TrajectoryInput> inputs = {{"part", kTruePoses, part, {}}};
  CHECK(plot_from_above(inputs, trajectory_error(inputs)).series[0].points.size() == part.size());
}

}  // namespace km
