# The laboratory with an installed kimera_multi. This file provides the parts that the tree provides
# otherwise: libraries, and the functions that make libraries and programs.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()
option(KM_UNITY "Compile the sources of a library or program in groups" ON)

find_package(kimera_multi REQUIRED
  COMPONENTS charts core evaluation heap images loop_closure opencv outlier_rejection place_recognition
             program rbcd recorded_graph robust runtime sensors_node session tree_newton)

# Include paths are those of the tree ("apps/lab/pgo/solvers.hpp"). Its root is no include folder,
# because the headers of modules must be the installed ones.
file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/include/apps)
file(CREATE_LINK ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR}/include/apps/lab SYMBOLIC)
set(KM_LAB_INCLUDE ${PROJECT_BINARY_DIR}/include)

function(km_group_sources target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${KM_UNITY} UNITY_BUILD_BATCH_SIZE 16)
  if(KM_UNITY)  # GCC treats the sources of a group as headers
    target_compile_options(${target} PRIVATE -Wno-subobject-linkage)
  endif()
endfunction()

# km_module(<name> SOURCES ... [LINK ...]): the library km_<name>.
function(km_module name)
  cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
  add_library(km_${name} STATIC ${arg_SOURCES})
  target_include_directories(km_${name} PUBLIC ${KM_LAB_INCLUDE})
  target_link_libraries(km_${name} PUBLIC kimera_multi::core ${arg_LINK})
  km_group_sources(km_${name})
endfunction()

# km_app(<name> SOURCES ... [LINK ...]): the executable bin/kimera_multi_<name>.
function(km_app name)
  cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
  add_executable(kimera_multi_${name} ${arg_SOURCES})
  target_link_libraries(kimera_multi_${name} PRIVATE kimera_multi::heap kimera_multi::program ${arg_LINK})
  install(TARGETS kimera_multi_${name})
endfunction()
