# What pellicle links: looked up when it is built and, by the installed package, for those who link it.
include(CMakeFindDependencyMacro)
find_dependency(MPI COMPONENTS C CXX)
find_dependency(PkgConfig)
find_dependency(Eigen3 3.4 NO_MODULE)
find_dependency(yaml-cpp)
find_dependency(VTK 9.1 COMPONENTS CommonCore CommonDataModel CommonExecutionModel CommonMisc FiltersCore IOXML IOParallelXML
                IOGeometry IOPLY IOLegacy IOImage ParallelCore ParallelMPI FiltersVerdict)
find_dependency(PNG)
find_dependency(ZLIB)
find_dependency(LAPACK)

# These have no CMake packages.
pkg_check_modules(PETSC QUIET IMPORTED_TARGET PETSc)
pkg_check_modules(HDF5 QUIET IMPORTED_TARGET hdf5-openmpi)  # PETSc's; CMake's own module finds the serial one
find_library(METIS_LIBRARY metis)
find_library(CHOLMOD_LIBRARY cholmod)
find_path(CHOLMOD_INCLUDE_DIR cholmod.h PATH_SUFFIXES suitesparse)
foreach(found PETSC_FOUND HDF5_FOUND METIS_LIBRARY CHOLMOD_LIBRARY CHOLMOD_INCLUDE_DIR)
  if(NOT ${found})
    set(pellicle_FOUND FALSE)
    set(pellicle_NOT_FOUND_MESSAGE "pellicle needs PETSc and parallel HDF5 (Open MPI), with their files for pkg-config, METIS and CHOLMOD; missing: ${found}")
    return()
  endif()
endforeach()
if(NOT TARGET METIS::METIS)
  add_library(METIS::METIS UNKNOWN IMPORTED)
  set_target_properties(METIS::METIS PROPERTIES IMPORTED_LOCATION "${METIS_LIBRARY}")
endif()
if(NOT TARGET CHOLMOD::CHOLMOD)
  add_library(CHOLMOD::CHOLMOD UNKNOWN IMPORTED)
  set_target_properties(CHOLMOD::CHOLMOD PROPERTIES IMPORTED_LOCATION "${CHOLMOD_LIBRARY}"
                        INTERFACE_INCLUDE_DIRECTORIES "${CHOLMOD_INCLUDE_DIR}")
endif()
