"""What is said of persons and groups: a cohort as a posterior, two visits of one person, planned studies."""
