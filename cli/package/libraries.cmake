# SPDX-License-Identifier: GPL-3.0-or-later
# Installs the baker's libraries as the component baker: vps::bake, vps::store and vps::tools.
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME baker)
set(headers FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR} FILES)
target_sources(vps_hdf5 PUBLIC ${headers} ${PROJECT_SOURCE_DIR}/formats/hdf5/hdf5_writer.h ${PROJECT_SOURCE_DIR}/formats/triangle_mesh.h)
target_sources(vps_mesh PUBLIC ${headers} ${PROJECT_SOURCE_DIR}/formats/mesh/mesh_import.h)
target_sources(vps_bake PUBLIC ${headers} ${PROJECT_SOURCE_DIR}/bake/vps_bake.h)
target_sources(vps_store PUBLIC ${headers}
  ${PROJECT_SOURCE_DIR}/bake/store/cache.h ${PROJECT_SOURCE_DIR}/bake/store/cache_upkeep.h
  ${PROJECT_SOURCE_DIR}/bake/store/vps_load_bullet.h ${PROJECT_SOURCE_DIR}/bake/store/vps_store.h)
target_sources(vps_tools PUBLIC ${headers}
  ${PROJECT_SOURCE_DIR}/cli/tools/compare/compare_assets.h ${PROJECT_SOURCE_DIR}/cli/tools/export/export.h
  ${PROJECT_SOURCE_DIR}/cli/tools/validate/check.h)
foreach(library hdf5 mesh bake store oracle tools)
  set_target_properties(vps_${library} PROPERTIES EXPORT_NAME ${library})
endforeach()
install(TARGETS vps_hdf5 vps_mesh vps_bake vps_store vps_tools EXPORT vps-baker-targets
  FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/vps)
install(TARGETS vps_oracle EXPORT vps-baker-targets)
install(EXPORT vps-baker-targets NAMESPACE vps:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/vps)
