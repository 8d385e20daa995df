#include "modules/core/io/text_rows.hpp"
#include "test/support/test.hpp"

namespace km {

using Fields = std::vector<std::string_view>;

TEST_CASE("Rows keep their line numbers past comments and empty lines") {
  const auto rows = split_rows("# header\n\n1,2\n   \n3,4\n");
  REQUIRE(rows.size() == 2);
  CHECK(rows[0].line == 3);
  CHECK(rows[1].line == 5);
  CHECK(rows[1].fields == Fields{"3", "4"});
}

TEST_CASE("Tables of spreadsheets and of other systems are read") {
  const std::string end = GENERATE("\n", "\r\n", "\r");
  const std::string text =
      "\xEF\xBB\xBF\"#t\",\"n\"" + end + "1 ,\ta b , \"3\" # note" + end + "4  5\t6" + end + "7; 8";
  const auto rows = split_rows(text);
  REQUIRE(rows.size() == 3);
  CHECK(rows[0].fields == Fields{"1", "a b", "3"});
  CHECK(rows[0].line == 2);
  CHECK(rows[1].fields == Fields{"4", "5", "6"});
  CHECK(rows[2].fields == Fields{"7", "8"});
  CHECK(rows[2].line == 4);
}

TEST_CASE("Empty fields between commas are kept") {
  CHECK(split_rows("1,,3,")[0].fields == Fields{"1", "", "3", ""});
  CHECK(split_rows("").empty());
}

TEST_CASE("An endless line gives no more fields than its reader asks for") {
  for (const char* text : {"1 2 3 4 5 6\n7", "1,2,3,4,5,6\n7"}) {
    RowReader rows(text, 4);
    CHECK(rows.next()->fields == Fields{"1", "2", "3", "4"});
    CHECK(rows.next()->line == 2);
    CHECK_FALSE(rows.next());
  }
}

TEST_CASE("A field is a number only if all of it is") {
  CHECK(parse_int64("1403636584763555584") == 1403636584763555584);
  CHECK(parse_double("+1.5e-3") == 1.5e-3);
  CHECK(std::isnan(parse_double("nan").value()));
  for (const std::string bad : {"", "1.5x", "1 2", "x", "-"}) {
    CAPTURE(bad);
    CHECK_FALSE(parse_double(bad));
    CHECK_FALSE(parse_int64(bad));
  }
  CHECK_FALSE(parse_int64("1.0"));
  CHECK_FALSE(parse_int64("99999999999999999999"));
}

}  // namespace km
