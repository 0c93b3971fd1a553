"""What has been shown: kept, looked at again, saved."""
