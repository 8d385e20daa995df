#include "modules/core/io/json.hpp"

#include <nlohmann/json.hpp>

#include "test/support/temporary_folder.hpp"
#include "test/support/test.hpp"

namespace km {

TEST_CASE("JSON text keeps keys in order and numbers exact and is always valid") {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const double third = 1.0 / 3.0;
  const Json json = {{"z", std::numeric_limits<std::uint64_t>::max()},
                     {"a \"q\"\n", third},
                     {"none", {kNone, -std::numeric_limits<double>::infinity()}},
                     {"torn", "\xff!"}};
  const std::string text = json_text(json);
  CHECK_THAT(text, StartsWith("{\n  \"z\": 18446744073709551615,\n  \"a \\\"q\\\"\\n\": ") &&
                       Contains("[\n    null,\n    null\n  ]") && EndsWith("\n}\n"));
  const Json again = Json::parse(text);
  CHECK(again["a \"q\"\n"] == third);
  CHECK(again["torn"] == "\xEF\xBF\xBD!");
}

TEST_CASE("A JSON file of brackets is refused at the level that is too deep") {
  const TemporaryFolder folder;
  for (const std::size_t levels : {60U, 1'000'000U}) {
    const auto file = folder.write("deep.json", std::string(levels, '['));
    CHECK_THROWS_WITH(read_json(file), Contains("deep.json: ") &&
                                           Contains(levels > 64 ? "nested deeper than 64 levels"
                                                                : "unexpected end"));
  }
}

}  // namespace km
