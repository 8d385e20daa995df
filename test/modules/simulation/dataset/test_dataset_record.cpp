#include <catch2/catch.hpp>

#include "modules/simulation/dataset/dataset_record.hpp"

namespace km {
namespace {

const DatasetRecord kRecord = {
    "simulator 1", {{"world", "city"}, {"duration", "30"}}, {"robot0"}, false};

}  // namespace

TEST_CASE("The record names what a run depends on", "[simulation][dataset]") {
  CHECK(to_json(kRecord) ==
        "{\n  \"generator\": \"simulator 1\",\n  \"parameters\": {\n    \"world\": \"city\",\n"
        "    \"duration\": \"30\"\n  },\n  \"finished_robots\": [\n    \"robot0\"\n  ],\n"
        "  \"complete\": false\n}\n");
}

TEST_CASE("Records differ by parameters and program, not by what is finished",
          "[simulation][dataset]") {
  DatasetRecord wanted = kRecord;
  wanted.finished_robots.clear();
  CHECK(differences(kRecord, wanted).empty());
  SECTION("another value") {
    wanted.parameters[1].second = "60";
    CHECK(differences(kRecord, wanted) ==
          std::vector<std::string>{"duration: 30 there, 60 asked for"});
  }
  SECTION("a parameter that only the folder has") {
    wanted.parameters.pop_back();
    CHECK(differences(kRecord, wanted) ==
          std::vector<std::string>{"duration: 30 there, not set asked for"});
  }
  SECTION("a parameter that only the run has") {
    wanted.parameters.emplace_back("seed", "2");
    CHECK(differences(kRecord, wanted) ==
          std::vector<std::string>{"seed: not set there, 2 asked for"});
  }
  SECTION("another program, first") {
    wanted.generator = "simulator 2";
    wanted.parameters[0].second = "camp";
    CHECK(differences(kRecord, wanted) ==
          std::vector<std::string>{"generator: simulator 1 there, simulator 2 asked for",
                                   "world: city there, camp asked for"});
  }
}

}  // namespace km
