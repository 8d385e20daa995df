# Writes OUTPUT, a header with the commit of SOURCE, and "-dirty" if tracked files differ from it. The
# commit is "unknown" outside git, and where a release is unpacked below another project's repository.
# The header is written only if its text changes, so an unchanged commit compiles nothing.
cmake_minimum_required(VERSION 3.21)
set(commit unknown)
execute_process(COMMAND git ls-files --error-unmatch CMakeLists.txt WORKING_DIRECTORY ${SOURCE}
  OUTPUT_QUIET ERROR_QUIET RESULT_VARIABLE untracked)
if(untracked EQUAL 0)
  execute_process(COMMAND git rev-parse --short=10 HEAD WORKING_DIRECTORY ${SOURCE}
    OUTPUT_VARIABLE head OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
  if(failed EQUAL 0)
    set(commit ${head})
    execute_process(COMMAND git diff --quiet HEAD -- . WORKING_DIRECTORY ${SOURCE}
      RESULT_VARIABLE changed ERROR_QUIET)
    if(NOT changed EQUAL 0)
      string(APPEND commit -dirty)
    endif()
  endif()
endif()
set(content "#pragma once\n\nnamespace km {\n\ninline constexpr const char* kCommit = \"${commit}\";\n\n}  // namespace km\n")
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT "${content}" @ONLY)
