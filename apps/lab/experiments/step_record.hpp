#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace km {

/// One command of an experiment, with its inputs and outputs.
struct Step {
  std::string name;                                 ///< Unique; stem of its record and its log.
  std::string title;                                ///< For people.
  std::vector<std::string> command;                 ///< Program first.
  std::vector<std::filesystem::path> inputs = {};   ///< Files whose content decides the result.
  std::vector<std::filesystem::path> outputs = {};  ///< Files that exist once it is done.
  std::vector<std::string> needs = {};              ///< Names of steps that must be done before.
  /// Copied (from, to) before the command is run.
  std::vector<std::pair<std::filesystem::path, std::filesystem::path>> copies = {};
  /// Texts (file, content) written before the command is run.
  std::vector<std::pair<std::filesystem::path, std::string>> writes = {};
  bool adoptable = false;    ///< Existing outputs without a record are accepted.
  double expected_s = 1.0;   ///< Approximate time on two cores.
  std::string missing = {};  ///< Reason why it cannot be run; empty if it can.
};

/// True if all files exist, and for an empty list.
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

/// Origin of the result of a step.
struct StepRecord {
  std::string step;
  std::string fingerprint =
      {};  ///< Fingerprint of the step when it was done, see fingerprint_of().
  std::vector<std::string> command;  ///< Empty: the result was found, not made.
  std::string started;               ///< "2026-11-20 14:58 UTC".
  double seconds = 0.0;
  std::string commit;  ///< Commit of this program.
  Machine machine;
};

/// A text that changes with the command, the texts it writes, and the content of the inputs. Paths
/// in the first two count only by their last name, so that folders, and the way they were typed, do
/// not matter. A missing input counts as missing.
[[nodiscard]] std::string fingerprint_of(const Step& step);

/// The record of a step in the results folder; nullopt if there is no readable one.
[[nodiscard]] std::optional<StepRecord> read_record(const std::filesystem::path& results,
                                                    const std::string& step);

/// Throws std::runtime_error naming the file.
void write_record(const std::filesystem::path& results, const StepRecord& record);

enum class StepState {
  kDone,      ///< Outputs are there and belong to this command and these inputs.
  kFound,     ///< Outputs exist, made by another program, and may be used.
  kOutdated,  ///< Outputs belong to another command or other inputs.
  kToDo,
  kMissing,  ///< An input is missing that only a person can supply.
};

[[nodiscard]] const char* to_string(StepState state);

/// State of a step by its record and its files; the steps on which it depends are not examined. An
/// outdated step whose inputs exist is kOutdated.
[[nodiscard]] StepState state_of(const Step& step, const std::filesystem::path& results);

}  // namespace km
