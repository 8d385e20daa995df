#include "modules/evaluation/images/image_report.hpp"

#include <catch2/catch.hpp>
#include <limits>
#include <sstream>

namespace km {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

const std::vector<ImageFigure> kReference = {
    {"corners", "mean", 100.0, 0},    {"corners", "p5", 50.0, 0},
    {"step", "frames, flow", 9.0, 0}, {"step", "survive, flow 3-6 px", 0.9, 3},
    {"step", "never had", kNone, 3},  {"step", "only here", 1.0, 3}};
const std::vector<ImageFigure> kOther = {{"corners", "mean", 120.0, 0},
                                         {"corners", "p5", 20.0, 0},
                                         {"step", "frames, flow", 1.0, 0},
                                         {"step", "survive, flow 3-6 px", 0.675, 3},
                                         {"step", "never had", 0.5, 3}};

}  // namespace

TEST_CASE("A table has a row for each figure below its heading", "[image_statistics]") {
  const std::string text = to_table(kReference);
  CHECK_THAT(text, Catch::StartsWith("corners\n  mean ") && Catch::Contains(" 100\n") &&
                       Catch::Contains("\n\nstep\n") && Catch::Contains(" 0.900\n") &&
                       Catch::Contains(" -\n"));
}

TEST_CASE("A comparison marks what differs by more than a quarter", "[image_statistics]") {
  const std::string text = to_comparison(kReference, kOther, "recorded", "rendered");
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    CAPTURE(line);
    const bool marked = line.ends_with("<--");
    CHECK(marked == (line.find("  p5 ") != line.npos));  // a quarter itself is not marked
    CHECK(line.find("only here") == line.npos);
  }
  CHECK_THAT(text, Catch::Contains("1.20") && Catch::Contains("0.75") &&
                       Catch::EndsWith(
                           "1 of 3 rows differ by more than 25 %; of those at like flow 0 of 1\n"));
}

TEST_CASE("The JSON of a comparison says ratio and verdict, row by row", "[image_statistics]") {
  std::ostringstream text;
  JsonWriter json(text);
  write_comparison(json, kReference, kOther);
  std::string flat;
  for (const char c : text.str())
    if (c != ' ' && c != '\n') flat += c;
  CHECK_THAT(flat,
             Catch::Contains(R"("other":120,"ratio":1.2,"differs":false)") &&
                 Catch::Contains(R"("other":20,"ratio":0.4,"differs":true)") &&
                 Catch::Contains(R"("reference":null,"other":0.5,"ratio":null,"differs":null)") &&
                 !Catch::Contains("onlyhere") && Catch::EndsWith(R"("compared":3,"differing":1})"));
}

TEST_CASE("The JSON nests figures in their sections, null for what is not had",
          "[image_statistics]") {
  std::ostringstream text;
  JsonWriter json(text);
  write_json(json, kReference);
  CHECK_THAT(text.str(), Catch::Contains("\"corners\": {") && Catch::Contains("\"p5\": 50") &&
                             Catch::Contains("\"never had\": null"));
}

}  // namespace km
