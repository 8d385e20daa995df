#include <catch2/catch.hpp>

#include "apps/lab/experiments/run_inputs.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {
namespace {

TEST_CASE("Inputs are kept with the results, as absolute paths", "[experiments]") {
  const TemporaryFolder folder;
  const auto results = folder.path() / "new/results";
  CHECK_FALSE(read_run_inputs(results));
  write_run_inputs(
      results,
      {.data = "some/../data", .graphs = "/graphs", .euroc = {}, .config = {}, .quick = true});
  const auto inputs = read_run_inputs(results);
  REQUIRE(inputs);
  CHECK(inputs->data == std::filesystem::current_path() / "data");
  CHECK(inputs->graphs == "/graphs");
  CHECK(inputs->euroc.empty());
  CHECK(inputs->quick);
}

TEST_CASE("Inputs that cannot be read are none", "[experiments]") {
  const TemporaryFolder folder;
  folder.write("inputs.json", GENERATE(as<std::string>(), "{\"data\": ", "{}", "[1]", ""));
  CHECK_FALSE(read_run_inputs(folder.path()));
}

}  // namespace
}  // namespace km
