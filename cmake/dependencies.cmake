# What pellicle links: looked up when it is built and, by the installed package, for those who link it.
include(CMakeFindDependencyMacro)
find_dependency(MPI COMPONENTS CXX)
find_dependency(PkgConfig)
find_dependency(Eigen3 3.4 NO_MODULE)
find_dependency(yaml-cpp)
find_dependency(fmt)

# VTK links MPI::MPI_C, which CMake has only for projects with the language C. Without it the target for C++, whose library
# is the same, takes its place, and VTK need not look for it.
get_property(pellicle_languages GLOBAL PROPERTY ENABLED_LANGUAGES)
if(NOT C IN_LIST pellicle_languages)
  if(NOT TARGET MPI::MPI_C)
    add_library(MPI::MPI_C INTERFACE IMPORTED)
    set_target_properties(MPI::MPI_C PROPERTIES INTERFACE_LINK_LIBRARIES MPI::MPI_CXX)
  endif()
  set(CMAKE_DISABLE_FIND_PACKAGE_MPI TRUE)
endif()
find_dependency(VTK 9.1 COMPONENTS CommonCore CommonDataModel CommonExecutionModel CommonMisc FiltersCore IOXML
                IOGeometry IOPLY IOLegacy IOImage ParallelCore ParallelMPI FiltersVerdict)
unset(CMAKE_DISABLE_FIND_PACKAGE_MPI)

find_dependency(PNG)
find_dependency(ZLIB)
find_dependency(LAPACK)

# These have no CMake packages.
pkg_check_modules(PETSC QUIET IMPORTED_TARGET PETSc)
pkg_check_modules(HDF5 QUIET IMPORTED_TARGET hdf5-openmpi)  # PETSc's; CMake's own module finds the serial one
find_library(METIS_LIBRARY metis)
find_library(CHOLMOD_LIBRARY cholmod)
find_path(CHOLMOD_INCLUDE_DIR cholmod.h PATH_SUFFIXES suitesparse)
find_library(MUMPS_LIBRARY dmumps)
find_path(MUMPS_INCLUDE_DIR dmumps_c.h)
foreach(found PETSC_FOUND HDF5_FOUND METIS_LIBRARY CHOLMOD_LIBRARY CHOLMOD_INCLUDE_DIR MUMPS_LIBRARY MUMPS_INCLUDE_DIR)
  if(NOT ${found})
    set(pellicle_FOUND FALSE)
    set(pellicle_NOT_FOUND_MESSAGE "pellicle needs PETSc and parallel HDF5 (Open MPI), with their files for pkg-config, METIS, CHOLMOD and MUMPS; missing: ${found}")
    return()
  endif()
endforeach()
if(NOT TARGET METIS::METIS)
  add_library(METIS::METIS UNKNOWN IMPORTED)
  set_target_properties(METIS::METIS PROPERTIES IMPORTED_LOCATION "${METIS_LIBRARY}")
endif()
foreach(library CHOLMOD MUMPS)
  if(NOT TARGET ${library}::${library})
    add_library(${library}::${library} UNKNOWN IMPORTED)
    set_target_properties(${library}::${library} PROPERTIES IMPORTED_LOCATION "${${library}_LIBRARY}"
                          INTERFACE_INCLUDE_DIRECTORIES "${${library}_INCLUDE_DIR}")
  endif()
endforeach()
