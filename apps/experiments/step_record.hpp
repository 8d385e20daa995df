#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace km {

/// One command of an experiment: what it reads and what it makes.
struct Step {
  std::string name;                                 ///< Unique; stem of its record and its log.
  std::string title;                                ///< For people.
  std::vector<std::string> command;                 ///< Program first.
  std::vector<std::filesystem::path> inputs = {};   ///< Files whose content decides the result.
  std::vector<std::filesystem::path> outputs = {};  ///< Files that are there once it is done.
  std::vector<std::string> needs = {};              ///< Names of steps that must be done before.
  /// Copied (from, to) before the command is run.
  std::vector<std::pair<std::filesystem::path, std::filesystem::path>> copies = {};
  /// Texts (file, content) written before the command is run.
  std::vector<std::pair<std::filesystem::path, std::string>> writes = {};
  bool adoptable = false;    ///< Outputs that are there without a record are taken as they are.
  double expected_s = 1.0;   ///< Roughly, on two cores.
  std::string missing = {};  ///< Why it cannot be run; empty if it can.
};

/// True if each is there, also if there are none.
[[nodiscard]] bool all_exist(const std::vector<std::filesystem::path>& files);

/// The computer a step was run on.
struct Machine {
  std::string processor;  ///< "AMD EPYC".
  unsigned cores = 0;
  double memory_gb = 0.0;
  double load = 0.0;  ///< Average of the last minute before the step.
};

/// This computer, now.
[[nodiscard]] Machine this_machine();

/// How the result of a step came about.
struct StepRecord {
  std::string step;
  std::string fingerprint = {};      ///< Of the step when it was done, see fingerprint_of().
  std::vector<std::string> command;  ///< Empty: the result was found, not made.
  std::string started;               ///< "2026-11-20 14:58 UTC".
  double seconds = 0.0;
  std::string commit;  ///< Of this program.
  Machine machine;
};

/// A text that changes with the command, what it writes, and the content of the inputs. Of a path
/// in the first two only the last name counts: it does not matter where things lie, or how that was
/// typed.
/// An input that is not there counts as such.
[[nodiscard]] std::string fingerprint_of(const Step& step);

/// The record of a step in the folder of results; nullopt if there is none that can be read.
[[nodiscard]] std::optional<StepRecord> read_record(const std::filesystem::path& results,
                                                    const std::string& step);

/// Throws std::runtime_error naming the file.
void write_record(const std::filesystem::path& results, const StepRecord& record);

enum class StepState {
  kDone,      ///< Outputs are there and belong to this command and these inputs.
  kFound,     ///< Outputs are there, made by somebody else, and may be used.
  kOutdated,  ///< They belong to another command or other inputs.
  kToDo,
  kMissing,  ///< Something is missing that only a person can supply.
};

[[nodiscard]] const char* to_string(StepState state);

/// Looks at the files only. An outdated step that needs none of the missing things is kOutdated.
[[nodiscard]] StepState state_of(const Step& step, const std::filesystem::path& results);

}  // namespace km
