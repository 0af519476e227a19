"""Checks `trace dataset --push s3://…` against moto, a server with the protocol of S3 that checks signatures and permissions.

Arguments: the program `trace`, a scene file, an empty folder.
"""

import http.server
import json
import logging
import os
import subprocess
import sys
import threading
from pathlib import Path

# Requests from the fifth on must be signed with a key that may do what they ask; the first four make the key and the bucket.
os.environ["INITIAL_NO_AUTH_ACTION_COUNT"] = "4"

import boto3
from moto.server import ThreadedMotoServer

logging.getLogger("werkzeug").setLevel(logging.ERROR)
trace, scene, folder = sys.argv[1], sys.argv[2], Path(sys.argv[3])
server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
server.start()
endpoint = "http://{}:{}".format(*server.get_host_and_port())


def client(name, key, secret):
    return boto3.client(name, endpoint_url=endpoint, region_name="eu-west-1", aws_access_key_id=key, aws_secret_access_key=secret)


iam = client("iam", "any", "any")
iam.create_user(UserName="robot")
allowed = {"Version": "2012-10-17", "Statement": [{"Effect": "Allow", "Action": "*", "Resource": "*"}]}
iam.put_user_policy(UserName="robot", PolicyName="all", PolicyDocument=json.dumps(allowed))
made = iam.create_access_key(UserName="robot")["AccessKey"]
key, secret = made["AccessKeyId"], made["SecretAccessKey"]
client("s3", "any", "any").create_bucket(Bucket="fields", CreateBucketConfiguration={"LocationConstraint": "eu-west-1"})


def run(*words, code, secret=secret, **variables):
    """Runs the program with the access key, and returns what it prints to stderr."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("AWS_")}
    own = {"AWS_ENDPOINT_URL_S3": endpoint, "AWS_ACCESS_KEY_ID": key, "AWS_SECRET_ACCESS_KEY": secret, "AWS_REGION": "eu-west-1"}
    ended = subprocess.run([trace, "dataset", *words], env={**kept, **own, **variables}, capture_output=True, text=True)
    assert ended.returncode == code, (words, ended)
    assert secret not in ended.stderr and secret not in ended.stdout
    return ended.stderr


data = folder / "d"
order = ["--scene", scene, "--count", "3", "--width", "24", "--spp", "1", "--format", "coco", "--quiet", "--out", str(data)]
# Mistakes that are found before an image is rendered.
assert "no access keys" in run(*order, "--push", "s3://fields", code=2, AWS_ACCESS_KEY_ID="", HOME=str(folder))
assert "3 to 63 lower-case letters" in run(*order, "--push", "s3://Fields/x", code=2)
assert "no effect with an s3 address" in run(*order, "--push", "s3://fields", "--push-check", "true", code=2)
assert "needs the program curl" in run(*order, "--push", "s3://fields", code=2, PATH="/nowhere")
assert not data.exists()
# Mistakes that only the store knows: one message with its answer.
once = ["--push-tries", "1"]
wrong = run(*order, "--push", "s3://fields/x", *once, code=1, secret="another")
assert "s3://fields/x/dataset.json: SignatureDoesNotMatch" in wrong, wrong
missing = run(*order, "--push", "s3://no-such-bucket/x", *once, code=1)
assert "NoSuchBucket" in missing, missing
refused = run(*order, "--push", "s3://fields/x", *once, code=1, AWS_ENDPOINT_URL_S3="http://127.0.0.1:9")
assert "Failed to connect" in refused, refused

# The same command goes on, and the bucket then contains the dataset.
prefix = "a set/ä+%"
run(*order, "--push", f"s3://fields/{prefix}/", code=0)
bucket = client("s3", key, secret)
copy = folder / "copy"
for found in bucket.list_objects_v2(Bucket="fields")["Contents"]:
    name = found["Key"].removeprefix(prefix + "/")
    assert name != found["Key"], found
    (copy / name).parent.mkdir(parents=True, exist_ok=True)
    bucket.download_file("fields", found["Key"], str(copy / name))
here = {str(path.relative_to(data)) for path in data.rglob("*") if path.is_file()}
there = {str(path.relative_to(copy)) for path in copy.rglob("*") if path.is_file()}
own = {name for name in here if name.startswith(("ledger/", "pushed/"))}
assert there == here - own, (there ^ here)
for name in there:
    assert (data / name).read_bytes() == (copy / name).read_bytes(), name
run("verify", str(copy), "--quiet", code=0)
assert len(list((data / "pushed").iterdir())) == 5  # recipe, three images, whole

# A temporary key has a token, which is signed as well.
trust = {"Version": "2012-10-17", "Statement": [{"Effect": "Allow", "Principal": {"AWS": "*"}, "Action": "sts:AssumeRole"}]}
role = client("iam", key, secret).create_role(RoleName="night", AssumeRolePolicyDocument=json.dumps(trust))["Role"]["Arn"]
client("iam", key, secret).put_role_policy(RoleName="night", PolicyName="all", PolicyDocument=json.dumps(allowed))
lent = client("sts", key, secret).assume_role(RoleArn=role, RoleSessionName="night")["Credentials"]
names = {"AWS_ACCESS_KEY_ID": "AccessKeyId", "AWS_SESSION_TOKEN": "SessionToken"}
temporary = {variable: lent[name] for variable, name in names.items()}
# Another address gets everything.
run(*order, "--push", "s3://fields/again", code=0, secret=lent["SecretAccessKey"], **temporary)
assert bucket.list_objects_v2(Bucket="fields", Prefix="again/")["KeyCount"] == len(there)

# A pack has more files in its formats than one process of curl uploads.
packed = folder / "packed"
many = [*order[:3], "8", *order[4:7], "1", "--format", "voc,kitti,yolo,yolo-detect,phenobench", "--pack", "8", "--quiet"]
run(*many, "--out", str(packed), "--push", "s3://fields/packed", code=0)
here = [path for path in packed.rglob("*") if path.is_file() and path.parent.name not in ("ledger", "pushed")]
listed = bucket.list_objects_v2(Bucket="fields", Prefix="packed/")["KeyCount"]
assert listed == len(here) > 80, (listed, len(here))

# A second run pushes nothing: it succeeds with a store that refuses everything.
run(*order, "--push", "s3://fields/again", *once, code=0, AWS_ENDPOINT_URL_S3="http://127.0.0.1:9")


# A redirect stores nothing, and no other protocol is used, whatever the endpoint says.
class Redirect(http.server.BaseHTTPRequestHandler):
    def do_PUT(self):
        self.rfile.read(int(self.headers["Content-Length"]))
        self.send_response(301)
        self.send_header("Content-Length", "0")
        self.end_headers()

    def log_message(self, *words):
        pass


elsewhere = http.server.HTTPServer(("127.0.0.1", 0), Redirect)
threading.Thread(target=elsewhere.serve_forever, daemon=True).start()
wrong = f"http://127.0.0.1:{elsewhere.server_port}"
moved = run(*order, "--push", "s3://fields/moved", *once, "--push-free", code=1, AWS_ENDPOINT_URL_S3=wrong)
assert "status 301" in moved and (data / "images/000000/rgb.png").is_file(), moved
for other in ("ftp://127.0.0.1", "file:///tmp", "127.0.0.1:9"):
    assert "no address of http" in run(*order, "--push", "s3://fields/x", code=2, AWS_ENDPOINT_URL_S3=other)
# Images that were removed after a push cannot be pushed elsewhere.
run(*order, "--push", "s3://fields/again", "--push-free", code=0)
assert "was pushed to s3://fields/again and removed here" in run(*order, "--push", "s3://fields/other", *once, code=2)
server.stop()
