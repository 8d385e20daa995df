#pragma once

#include <catch2/catch.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "modules/core/json.hpp"
#include "test/support/command.hpp"
#include "test/support/temporary_folder.hpp"

namespace km {

/// Content of an MCAP file according to readers of npm; nullopt if they are not available.
inline std::optional<Json> read_by_others(const std::filesystem::path& file,
                                          const TemporaryFolder& folder) {
  const std::filesystem::path work = folder.path() / "npm";
  std::filesystem::create_directories(work);
  for (const char* source : {"package.json", "read_record.mjs"})
    std::filesystem::copy_file(std::filesystem::path("test/system/record") / source, work / source,
                               std::filesystem::copy_options::overwrite_existing);
  const std::string in_work = "cd " + work.string() + " && ";
  if (run_command(in_work + "npm install --silent --no-audit --no-fund --prefer-offline")
          .exit_code != 0)
    return std::nullopt;
  const CommandResult result =
      run_command(in_work + "node read_record.mjs " + file.string() + " > read.json");
  CAPTURE(result.output);
  REQUIRE(result.exit_code == 0);
  return read_json(work / "read.json");
}

}  // namespace km
