# Stand-ins for the commands of Vivado with which a core is packaged: what Vivado would refuse is an error, and what the IP becomes is
# written to calls.txt, the fields of a line between tabs. Objects have their kind in front of their name.
set calls [open calls.txt w]
set objects {}
proc note {args} { puts $::calls [join $args "\t"] }
proc new {object} {
  if {$object in $::objects} { error "$object is there already" }
  lappend ::objects $object
  return $object
}
proc known {object} {
  if {$object ni $::objects} { error "there is no $object" }
  return $object
}

# Properties that an object of each kind has.
array set properties {
  file {file_type used_in}
  fileset {top}
  core {name version core_revision display_name description supported_families auto_family_support_level}
  bus {bus_type_vlnv abstraction_type_vlnv interface_mode slave_memory_map_ref}
  port {physical_name}
  parameter {value}
  map {}
  block {range width usage}
}
proc set_property {property value objects} {
  foreach object $objects {
    if {$property ni $::properties([lindex [split [known $object] :] 0])} { error "$object has no property $property" }
    note set $object $property $value
  }
}
proc get_property {property object} {
  if {$property ne "name"} { error "get_property $property" }
  return [lindex [split [known $object] :] 1]
}

proc create_project {force name folder} {
  if {$force ne "-force"} { error "create_project $force" }
  new fileset:sources_1
}
proc current_fileset {} { return fileset:sources_1 }
proc add_files {norecurse args} {
  if {$norecurse ne "-norecurse"} { error "add_files $norecurse" }
  if {[llength $args] == 3 && [lrange $args 0 1] ne "-fileset constrs_1"} { error "add_files $args" }
  foreach file [lindex $args end] {
    if {![file exists $file]} { error "there is no $file" }
    note file [new file:$file]
  }
}
proc get_files {names} {
  set found {}
  foreach name $names { lappend found [known file:$name] }
  return $found
}
proc update_compile_order {fileset name} {}
proc close_project {} { note closed }

namespace eval ipx {
  # An interface and a map that Vivado takes from the names of ports.
  proc package_project {args} {
    note package {*}$args
    new core:own
    new bus:s_axis
    new map:inferred
  }
  proc current_core {} { known core:own }
  proc remove_all_bus_interface {core} { set ::objects [lsearch -all -inline -not $::objects bus:*] }
  proc get_memory_maps {of core} { lsearch -all -inline $::objects map:* }
  proc remove_memory_map {name core} {
    known map:$name
    set ::objects [lsearch -all -inline -not -exact $::objects map:$name]
  }
  proc add_bus_interface {name core} { known $core; new bus:$name }
  proc get_bus_interfaces {name of core} { known bus:$name }
  proc add_port_map {name bus} { new port:[known $bus]:$name }
  proc add_bus_parameter {name bus} { new parameter:[known $bus]:$name }
  proc add_memory_map {name core} { known $core; new map:$name }
  proc add_address_block {name map} { new block:[known $map]:$name }
  proc create_xgui_files {core} { known $core }
  proc update_checksums {core} { known $core }
  proc check_integrity {core} { known $core }
  proc save_core {core} { note saved [known $core] }
}
