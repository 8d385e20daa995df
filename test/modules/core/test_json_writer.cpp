#include "modules/core/json_writer.hpp"

#include <catch2/catch.hpp>
#include <cstdint>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

namespace km {

TEST_CASE("A document has its commas, indents and escapes in place", "[core]") {
  std::ostringstream text;
  JsonWriter json(text);
  json.begin_object();
  json.field("a", 1);
  json.field("b \"q\"\n", "back\\slash");
  json.key("list");
  json.begin_array();
  json.value(true);
  json.begin_object();
  json.end_object();
  json.end_array();
  json.end_object();
  CHECK(text.str() ==
        "{\n"
        "  \"a\": 1,\n"
        "  \"b \\\"q\\\"\\u000a\": \"back\\\\slash\",\n"
        "  \"list\": [\n"
        "    true,\n"
        "    {}\n"
        "  ]\n"
        "}\n");
}

TEST_CASE("Numbers keep their value, what is no number becomes null", "[core]") {
  std::ostringstream text;
  JsonWriter json(text);
  json.begin_array();
  json.value(0.1);
  json.value(1e-300);
  json.value(std::numeric_limits<std::uint64_t>::max());
  json.value(std::numeric_limits<double>::quiet_NaN());
  json.value(-std::numeric_limits<double>::infinity());
  json.end_array();
  CHECK(text.str() == "[\n  0.1,\n  1e-300,\n  18446744073709551615,\n  null,\n  null\n]\n");
}

TEST_CASE("Fields come in a row, and objects in a list", "[core]") {
  std::ostringstream text;
  JsonWriter json(text);
  json.begin_object();
  json.fields("a", 1, "b", "two");
  json.objects("list", std::vector<int>{3}, [&](int x) { json.fields("x", x, "odd", x % 2 == 1); });
  json.objects("none", std::vector<int>{}, [&](int x) { json.field("x", x); });
  json.end_object();
  CHECK(text.str() ==
        "{\n  \"a\": 1,\n  \"b\": \"two\",\n  \"list\": [\n    {\n      \"x\": 3,\n"
        "      \"odd\": true\n    }\n  ],\n  \"none\": []\n}\n");
}

TEST_CASE("A list of values is a field of its own", "[core]") {
  std::ostringstream text;
  JsonWriter json(text);
  json.begin_object();
  json.array("names", std::vector<std::string>{"a", "b"});
  json.array("none", std::vector<int>{});
  json.end_object();
  CHECK(text.str() == "{\n  \"names\": [\n    \"a\",\n    \"b\"\n  ],\n  \"none\": []\n}\n");
}

}  // namespace km
