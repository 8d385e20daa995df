#include <catch2/catch.hpp>

#include <nlohmann/json.hpp>

#include "modules/diagnosis/finding.hpp"

namespace km {
namespace {

Finding finding_of(const char* id, Severity severity) {
  return {.id = id, .severity = severity, .what = "7 of 9", .means = "m", .to_do = "t"};
}

}  // namespace

TEST_CASE("Findings are sorted by severity, and the most severe gives the exit code",
          "[diagnosis]") {
  std::vector<Finding> findings = {
      finding_of("a", Severity::kNote), finding_of("b", Severity::kError),
      finding_of("c", Severity::kNote), finding_of("d", Severity::kWarning),
      finding_of("e", Severity::kError)};
  sort_by_severity(findings);
  std::string order;
  for (const Finding& finding : findings) order += finding.id;
  CHECK(order == "bedac");
  CHECK(exit_code_of(findings) == 2);
  CHECK(exit_code_of(std::span(findings).last(3)) == 1);
  CHECK(exit_code_of(std::span(findings).last(2)) == 0);
  CHECK(exit_code_of({}) == 0);
}

TEST_CASE("A finding is three lines for people", "[diagnosis]") {
  Finding finding = finding_of("stereo.swapped", Severity::kWarning);
  CHECK(to_text(std::span(&finding, 1)) ==
        "warning stereo.swapped: 7 of 9\n  means: m\n  to do: t\n");
  finding.to_do.clear();
  CHECK(to_text(std::span(&finding, 1)) == "warning stereo.swapped: 7 of 9\n  means: m\n");
  CHECK(to_text(std::vector<Finding>()).empty());
}

TEST_CASE("A finding is equal after writing and reading JSON", "[diagnosis]") {
  const Finding finding = finding_of("a.b", Severity::kError);
  CHECK(Json(finding).get<Finding>() == finding);
  CHECK(Json(finding).dump() ==
        R"({"id":"a.b","severity":"error","what":"7 of 9","means":"m","to_do":"t"})");
  CHECK_THROWS_WITH((Json{{"severity", "fatal"}}.get<Finding>()), Catch::Contains("fatal"));
}

}  // namespace km
