"""From a rigged, skinned character to a doll: read, group, fit, joint, weigh, report."""
