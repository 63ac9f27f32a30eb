# What an installation has beside the program and its library, and the Debian package that cpack makes of it.

# Who makes the package, "NAME <ADDRESS>", as Debian's tools take it from the environment.
set(maintainer "The pellicle developers")
if(DEFINED ENV{DEBEMAIL})
  set(maintainer "$ENV{DEBEMAIL}")
  if(DEFINED ENV{DEBFULLNAME})
    set(maintainer "$ENV{DEBFULLNAME} <$ENV{DEBEMAIL}>")
  endif()
endif()
set(PELLICLE_MAINTAINER "${maintainer}" CACHE STRING "Maintainer of the Debian package: NAME <ADDRESS>")
set(signature "${PELLICLE_MAINTAINER}")
if(NOT signature MATCHES "<.*>")
  string(APPEND signature " <>")
endif()

# The man page and the completion of bash, from the table of options, and what has changed; compressed as Debian wants it.
find_package(Python3 REQUIRED COMPONENTS Interpreter)
set(manual ${Python3_EXECUTABLE} ${CMAKE_SOURCE_DIR}/tools/manual)
set(made ${CMAKE_BINARY_DIR}/manual)
file(MAKE_DIRECTORY ${made})
add_custom_command(
  OUTPUT ${made}/pellicle.1.gz ${made}/pellicle ${made}/changelog.gz
  COMMAND ${manual} man_page | gzip -9n > ${made}/pellicle.1.gz
  COMMAND ${manual} completion > ${made}/pellicle
  COMMAND ${manual} changelog --maintainer ${signature} | gzip -9n > ${made}/changelog.gz
  DEPENDS tools/manual input/OPTIONS.md CMakeLists.txt cmake/pellicle.1.in cmake/pellicle.bash.in docs/CHANGELOG.md
  COMMENT "Writing the man page and the completion"
  VERBATIM)
add_custom_target(pellicle_manual ALL DEPENDS ${made}/pellicle.1.gz)
add_dependencies(pellicle pellicle_manual)

install(FILES ${made}/pellicle.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
install(FILES ${made}/pellicle DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
install(FILES ${made}/changelog.gz docs/CITATION.cff DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright)
install(DIRECTORY postproc/paraview DESTINATION ${CMAKE_INSTALL_DATADIR}/pellicle/postproc)
install(DIRECTORY input meshes DESTINATION ${CMAKE_INSTALL_DATADIR}/pellicle PATTERN *.py EXCLUDE)
# The scripts that a user of runs needs, and their modules; those for pvbatch are none by themselves.
install(PROGRAMS postproc/ensemble.py postproc/export.py postproc/folds.py postproc/plots.py
        DESTINATION ${CMAKE_INSTALL_DATADIR}/pellicle/postproc)
install(FILES postproc/compare.py postproc/render.py postproc/light.py postproc/materials.py postproc/run_folder.py
              postproc/run_frames.py DESTINATION ${CMAKE_INSTALL_DATADIR}/pellicle/postproc)

# Linking the library needs what compiling it did: the packages below "# libraries" in the list, up to the next heading.
file(READ tools/packages.txt packages)
string(REGEX REPLACE "^.*\n# libraries\n([^#]*)\n#.*$" "\\1" packages "${packages}")
string(REPLACE "\n" ";" packages "${packages}")
list(REMOVE_ITEM packages openmpi-bin libopenblas0-pthread)  # which running needs, too
list(JOIN packages ", " packages)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "${PELLICLE_MAINTAINER}")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "simulates thin sheets that burn, tear, wrinkle and inflate")
set(CPACK_PACKAGE_DESCRIPTION "pellicle is a parallel solver, on PETSc and MPI, for sheets of paper and
cloth that heat, burn, shrink, wrinkle and tear, and for balloons of rubber
with thickness round an enclosed gas.
.
The package has the program, its scenes and meshes, scripts that draw and plot
what it writes, and a C++ library.")
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS openmpi-bin)  # mpirun; dpkg-shlibdeps finds the libraries
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "libopenblas0-pthread, python3, python3-matplotlib, python3-numpy")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "paraview, python3-paraview, ffmpeg, cmake, pkg-config, ${packages}")
include(CPack)
