# Installs BUILD into a prefix inside WORK, moves the prefix, and builds and runs the program of this folder against it.
cmake_policy(VERSION 3.25)

# Runs a command in WORK; what it says is shown when it fails.
function(run)
  list(JOIN ARGV " " line)
  execute_process(COMMAND ${ARGV} WORKING_DIRECTORY ${WORK} RESULT_VARIABLE status OUTPUT_VARIABLE text ERROR_VARIABLE text)
  if(NOT status EQUAL 0)
    message("${text}")
    message(FATAL_ERROR "${line}: ended with ${status}")
  endif()
  set(text "${text}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK}/elsewhere)
run(${CMAKE_COMMAND} --install ${BUILD} --config ${CONFIG} --prefix ${WORK}/first)
set(prefix ${WORK}/elsewhere/pellicle)
file(RENAME ${WORK}/first ${prefix})

# No file knows where it was made. Debugging information does.
set(texts_only "")
if(CONFIG STREQUAL Debug)
  set(texts_only -I)
endif()
execute_process(COMMAND grep -rlF ${texts_only} -e ${BUILD} -e ${SOURCE}/src -e ${WORK} ${prefix} OUTPUT_VARIABLE files
                RESULT_VARIABLE status)
if(NOT status EQUAL 1)
  message(FATAL_ERROR "paths of this machine in\n${files}")
endif()

# Headers find each other without their folders on the include path.
file(GLOB_RECURSE headers ${prefix}/include/*.h)
list(LENGTH headers count)
if(count LESS 100)
  message(FATAL_ERROR "${count} headers below ${prefix}/include, expected all")
endif()
foreach(header ${headers})
  file(STRINGS ${header} includes REGEX "^#include \"")
  foreach(include ${includes})
    string(REGEX REPLACE "^#include \"(.*)\".*" "\\1" name "${include}")
    if(NOT name MATCHES "^pellicle/" OR NOT EXISTS ${prefix}/include/${name})
      message(FATAL_ERROR "${header}: \"${name}\" is not an installed header")
    endif()
  endforeach()
endforeach()

foreach(file bin/pellicle share/pellicle/input/OPTIONS.md share/doc/pellicle/copyright
        share/man/man1/pellicle.1.gz share/bash-completion/completions/pellicle)
  if(NOT EXISTS ${prefix}/${file})
    message(FATAL_ERROR "${file} is not installed")
  endif()
endforeach()
run(${prefix}/bin/pellicle ${prefix}/share/pellicle/input/curtain.yaml -mesh_only)

run(${CMAKE_COMMAND} -G ${GENERATOR} -S ${CMAKE_CURRENT_LIST_DIR} -B ${WORK}/build -DCMAKE_PREFIX_PATH=${prefix}
    -DCMAKE_BUILD_TYPE=${CONFIG} -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_CXX_FLAGS=${FLAGS})
file(STRINGS ${WORK}/build/CMakeCache.txt found REGEX "^pellicle_DIR:")
if(NOT found MATCHES "=${prefix}/")
  message(FATAL_ERROR "another package was found: ${found}")
endif()
run(${CMAKE_COMMAND} --build ${WORK}/build)
foreach(ranks 1 2)
  run(${MPIEXEC} -n ${ranks} ${WORK}/build/falling_paper)
  message("${ranks} ranks:\n${text}")
endforeach()
