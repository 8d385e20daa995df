# Writes OUTPUT, a header with the commit of SOURCE; "-changed" if files differ from it. The file is
# touched only if that is new, so that nothing is compiled again for nothing.
cmake_minimum_required(VERSION 3.21)
execute_process(COMMAND git -C ${SOURCE} rev-parse --short=10 HEAD
  OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
if(failed)
  set(commit unknown)
else()
  execute_process(COMMAND git -C ${SOURCE} diff --quiet HEAD -- RESULT_VARIABLE changed ERROR_QUIET)
  if(changed)
    string(APPEND commit -changed)
  endif()
endif()
set(content "#pragma once\n\nnamespace km {\n\ninline constexpr const char* kCommit = \"${commit}\";\n\n}  // namespace km\n")
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT "${content}" @ONLY)
